/* The Mariner written by hand: what a simulator's programmer would write for this one ship. */
#ifndef MARINER_H
#define MARINER_H

/* Coefficients of (3.8), prime system, rudder positive to starboard, in the order of the model's parameters. */
typedef struct {
    double X0, Xu, Xuu, Xuuu, Xvv, Xrr, Xdd, Xvvu, Xrru, Xddu, Xvr, Xvd, Xrd, Xvru, Xvdu, Xrdu;
    double Y0, Y0u, Y0uu, Yv, Yvvv, Yvrr, Yvdd, Yvu, Yvuu, Yr, Yrrr, Yvvr, Yrdd, Yru, Yruu, Yd, Yddd, Yvvd, Yrrd, Ydu,
        Yduu, Yvrd;
    double N0, N0u, N0uu, Nv, Nvvv, Nvrr, Nvdd, Nvu, Nvuu, Nr, Nrrr, Nvvr, Nrdd, Nru, Nruu, Nd, Nddd, Nvvd, Nrrd, Ndu,
        Nduu, Nvrd;
    double Xudot, Yvdot, Yrdot, Nvdot, Nrdot;
} Coefficients;

typedef struct {
    double length, speed, density;       /* m, m/s, kg/m3 */
    double mass, x_G, yaw_inertia;       /* prime */
    double lag, rate_limit, angle_limit; /* steering gear: s, rad/s, rad */
    Coefficients c;
} Ship;

typedef struct {
    double x, y, psi, u, v, r, rudder; /* m, rad, m/s, rad/s */
} Motion;

void mariner_step(const Ship *ship, Motion *motion, double order, double h);

#endif
