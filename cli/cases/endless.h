// Light in an endless medium that scatters evenly in all directions: one extinction 1 everywhere.
#pragma once

namespace ls::cases {

// The fluence (W per square mean free path, over all directions, unscattered light included) at `distance`
// mean free paths from the middle of a ball of radius `radius` that gives off 1 W, evenly and in all
// directions; of a point for radius 0. 0 < albedo < 1, 0 <= radius < distance. Good to 1e-7. Case, de
// Hoffmann and Placzek, Introduction to the Theory of Neutron Diffusion I (1953): the poles and the cut of
// the Fourier transform A / (1 - c A), A(k) = atan(k) / k, of the point's fluence. Each of its terms is e^(-k
// r) / r, whose mean over a ball is the same one times 3 (x cosh x - sinh x) / x^3, x = k radius.
double endless_fluence(double albedo, double distance, double radius);

}  // namespace ls::cases
