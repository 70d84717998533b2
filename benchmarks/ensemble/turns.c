/* What a programmer would write by hand for an ensemble of one ship: a turn of each member, the last motion kept. */
#include "../fmu_step/mariner.h"

void turns(long members, long steps, double h, double order, const Ship *ships, Motion *ends) {
    for (long k = 0; k < members; ++k) {
        Motion motion = {0, 0, 0, 0, 0, 0, 0};
        motion.u = ships[k].speed;
        for (long i = 0; i < steps; ++i) mariner_step(&ships[k], &motion, order, h);
        ends[k] = motion;
    }
}
