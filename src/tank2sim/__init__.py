"""From what a towing tank or a sea trial measured to a verified ship model inside a simulator.

``import tank2sim as t2s`` gives the names that ``__init__.pyi`` declares; each is imported when it is first used.
"""

import lazy_loader

from tank2sim.version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
