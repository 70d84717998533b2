#include "mariner.h"

#include <math.h>

static double limited(double value, double limit) { return fmax(-limit, fmin(limit, value)); }

static void rates(const Ship *ship, const Motion *m, double order, Motion *rate) {
    const Coefficients *c = &ship->c;
    const double L = ship->length;
    const double U = sqrt(m->u * m->u + m->v * m->v);
    const double v = m->v / U, r = m->r * L / U, d = m->rudder, u = (m->u - ship->speed) / U;
    const double vv = v * v, rr = r * r, dd = d * d, uu = u * u;
    const double X = c->X0 + c->Xu * u + c->Xuu * uu + c->Xuuu * uu * u + c->Xvv * vv + c->Xrr * rr + c->Xdd * dd +
                     c->Xvvu * vv * u + c->Xrru * rr * u + c->Xddu * dd * u + c->Xvr * v * r + c->Xvd * v * d +
                     c->Xrd * r * d + c->Xvru * v * r * u + c->Xvdu * v * d * u + c->Xrdu * r * d * u;
    const double Y = c->Y0 + c->Y0u * u + c->Y0uu * uu + c->Yv * v + c->Yvvv * vv * v + c->Yvrr * v * rr +
                     c->Yvdd * v * dd + c->Yvu * v * u + c->Yvuu * v * uu + c->Yr * r + c->Yrrr * rr * r +
                     c->Yvvr * vv * r + c->Yrdd * r * dd + c->Yru * r * u + c->Yruu * r * uu + c->Yd * d +
                     c->Yddd * dd * d + c->Yvvd * vv * d + c->Yrrd * rr * d + c->Ydu * d * u + c->Yduu * d * uu +
                     c->Yvrd * v * r * d;
    const double N = c->N0 + c->N0u * u + c->N0uu * uu + c->Nv * v + c->Nvvv * vv * v + c->Nvrr * v * rr +
                     c->Nvdd * v * dd + c->Nvu * v * u + c->Nvuu * v * uu + c->Nr * r + c->Nrrr * rr * r +
                     c->Nvvr * vv * r + c->Nrdd * r * dd + c->Nru * r * u + c->Nruu * r * uu + c->Nd * d +
                     c->Nddd * dd * d + c->Nvvd * vv * d + c->Nrrd * rr * d + c->Ndu * d * u + c->Nduu * d * uu +
                     c->Nvrd * v * r * d;
    const double surge = ship->mass - c->Xudot, sway = ship->mass - c->Yvdot, yaw = ship->yaw_inertia - c->Nrdot;
    const double sway_yaw = ship->mass * ship->x_G - c->Yrdot, yaw_sway = ship->mass * ship->x_G - c->Nvdot;
    const double f4 = sway * yaw - sway_yaw * yaw_sway, scale = U * U / L;
    const double cosine = cos(m->psi), sine = sin(m->psi);
    rate->x = m->u * cosine - m->v * sine;
    rate->y = m->u * sine + m->v * cosine;
    rate->psi = m->r;
    rate->u = X / surge * scale;
    rate->v = (Y * yaw - N * sway_yaw) / f4 * scale;
    rate->r = (N * sway - Y * yaw_sway) / f4 * scale / L;
    rate->rudder = limited((limited(order, ship->angle_limit) - d) / ship->lag, ship->rate_limit);
}

static Motion moved(const Motion *m, const Motion *rate, double h) {
    const Motion result = {m->x + h * rate->x, m->y + h * rate->y, m->psi + h * rate->psi,         m->u + h * rate->u,
                           m->v + h * rate->v, m->r + h * rate->r, m->rudder + h * rate->rudder};
    return result;
}

/* One classical Runge-Kutta step of h seconds, the rudder order (rad, + to starboard) held. */
void mariner_step(const Ship *ship, Motion *motion, double order, double h) {
    Motion k1, k2, k3, k4, at;
    rates(ship, motion, order, &k1);
    at = moved(motion, &k1, h / 2);
    rates(ship, &at, order, &k2);
    at = moved(motion, &k2, h / 2);
    rates(ship, &at, order, &k3);
    at = moved(motion, &k3, h);
    rates(ship, &at, order, &k4);
    *motion = moved(motion, &k1, h / 6);
    *motion = moved(motion, &k2, h / 3);
    *motion = moved(motion, &k3, h / 3);
    *motion = moved(motion, &k4, h / 6);
}
