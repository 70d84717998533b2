"""The MMG standard method: hull, propeller, rudder and their interactions, each a module of its own.

Yasukawa and Yoshimura (2015), Introduction of MMG standard method for ship maneuvering predictions, J. Mar. Sci.
Technol. 20, 37-52.
"""
