// Absorption alone: Beer and Lambert, and the mean path through a body.
#include <cmath>

#include "tests/statistical/case.h"

namespace ls::test {
namespace {

constexpr Rgb kSigma{0, 1,
                     16};  // a hero channel without extinction and one that is all but opaque (STABILITY N15)

std::array<double, 3> through(double depth) {
  return {std::exp(-kSigma[0] * depth), std::exp(-kSigma[1] * depth), std::exp(-kSigma[2] * depth)};
}

// The unit cube before a white sky, seen along x through its middle.
SceneKit sky() {
  SceneKit kit;
  kit.environment();
  kit.look({-3, .5, .5}, {.5, .5, .5});
  return kit;
}
Transform unit_cube() { return translate({.5, .5, .5}) * scale(.5); }

}  // namespace

void add_attenuation(std::vector<Case>& cases) {
  {
    SceneKit kit = sky();
    kit.container(CubeShape{}, unit_cube(), kit.null(), kit.homogeneous(kSigma, rgb(0)));
    cases.push_back({"beer_lambert_homogeneous", kit, through(1), 4096});
  }
  {
    SceneKit kit = sky();
    kit.container(CubeShape{}, unit_cube(), kit.null(), kit.heterogeneous(kit.constant(kSigma), rgb(0)));
    cases.push_back({"beer_lambert_constant_grid", kit, through(1), 4096});
  }
  {
    // Density 0, 1, 2, 3 at voxel centres 1/8, 3/8, 5/8, 7/8, clamped beyond: the integral is 1.5, a third of
    // it .5.
    SceneKit kit = sky();
    const VolumeIndex ramp = kit.grid({4, 1, 1}, {0, 1, 2, 3}, Transform{});
    kit.container(CubeShape{}, unit_cube(), kit.null(), kit.heterogeneous(ramp, rgb(0), 1. / 3));
    cases.push_back({"beer_lambert_linear_grid", kit, grey(std::exp(-.5)), 8192});
  }
  {
    // One hot voxel among empty ones, 16 of them to a side: along its axis the integral is rho h = 8 / 16.
    SceneKit kit = sky();
    std::vector<float> values(16 * 16 * 16, 0);
    values[(8 * 16 + 8) * 16 + 8] = 8;
    kit.container(CubeShape{}, unit_cube(), kit.null(),
                  kit.heterogeneous(kit.grid({16, 16, 16}, values, Transform{}), rgb(0)));
    kit.look({-3, 8.5 / 16, 8.5 / 16}, {.5, 8.5 / 16, 8.5 / 16}, 1e-5);
    cases.push_back({"beer_lambert_hot_voxel", kit, grey(std::exp(-.5)), 8192});
  }
  // Mean path 4V/S = 4R/3, whatever scatters inside (Blanco and Fournier 2003): mean(1 - L) = sigma_a 4R/3,
  // less the share sigma_a <l^2> / (2 <l>) = sigma_a x mean path still to go from inside. That is .75 R
  // without scattering, and diffusion adds about R^2 sigma_s / 5 = .4 R: below 2 R. A path's weight is a
  // product of albedos, each rounded by 2^-25: against sigma_a / sigma_t = 5e-4 a share of 6e-5.
  for (const double g : {0., .9}) {
    constexpr double kAbsorption = 1e-3, kScattering = 2, kDistance = 1000, kMargin = 1.01;
    SceneKit kit({32, 32});
    const double a = kScattering / (kScattering + kAbsorption);
    kit.container(SphereShape{}, {}, kit.null(), kit.homogeneous(rgb(kScattering + kAbsorption), rgb(a), g));
    kit.environment();
    kit.scene.integrator.rr_depth = 1000;  // roulette on weights of .9995 would be all the noise there is
    kit.look({0, -kDistance, 0}, {0, 0, 0}, 2 * std::atan(kMargin / kDistance) * 180 / kPi);
    const double share = kPi / (4 * kMargin * kMargin);  // of the film that the sphere covers
    Case c{g == 0 ? "mean_path_isotropic" : "mean_path_forward", kit, grey(share * kAbsorption * 4 / 3), 1024,
           .02};
    c.slack = 2 * kAbsorption + 6e-5;
    c.complement = true;
    cases.push_back(c);
  }
}

}  // namespace ls::test
