// Translates media and their grids.
#include <fmt/format.h>

#include <cmath>

#include "common/scene/pbrt/parts.h"
#include "common/scene/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

constexpr int kMaxSide = 4096;
constexpr std::size_t kMaxVoxels = std::size_t{1} << 24;  // includes the layer of zeros around the grid

class MediumTranslator {
 public:
  MediumTranslator(Translation& t, Params& p, const Placed& ctm) : t_(t), p_(p), ctm_(ctm) {}

  std::optional<Element> run() {
    const std::string_view type = p_.row().type;
    Element out = made("medium", type == "homogeneous" ? "homogeneous" : "heterogeneous", p_.at());
    const bool fine = type == "homogeneous" ? homogeneous(out)
                      : type == "nanovdb"   ? nanovdb(out)
                      : type == "rgbgrid"   ? rgb_grid(out)
                                            : uniform_grid(out);
    if (const double g = p_.number("g", 0); g != 0) {
      Element hg = made("phase", "hg", p_.at());
      add(hg, "g", g, p_.at());
      add(out, std::move(hg));
    }
    p_.finish();
    return fine ? std::optional(std::move(out)) : std::nullopt;
  }

 private:
  struct Coefficients {
    Rgb extinction{}, albedo{};
    bool is_grey() const { return extinction[0] == extinction[1] && extinction[1] == extinction[2]; }
  };

  Rgb one(std::string_view name) {
    const Param* p = p_.take(name);
    return p ? surface_colour(t_, *p).value_or(Rgb{1, 1, 1}) : Rgb{1, 1, 1};
  }

  Coefficients coefficients() {
    const Rgb a = one("sigma_a"), s = one("sigma_s");
    Coefficients c;
    for (std::size_t i = 0; i < 3; ++i) {
      c.extinction[i] = a[i] + s[i];
      c.albedo[i] = c.extinction[i] > 0 ? s[i] / c.extinction[i] : 0;
    }
    return c;
  }

  bool homogeneous(Element& out) {
    const Coefficients c = coefficients();
    add(out, "sigma_t", c.extinction, p_.at());
    add(out, "albedo", c.albedo, p_.at());
    add(out, "scale", p_.number("scale", 1), p_.at());
    const double scale = p_.number("Lescale", 1) * t_.exposure;
    if (!p_.has("Le")) return true;
    Rgb light = light_colour(t_, p_, "Le");
    for (double& x : light) x *= scale;
    if (!all_zero(light)) add(out, "source_radiance", light, p_.at());
    return true;
  }

  bool nanovdb(Element& out) {
    const Coefficients c = coefficients();
    Element grid = made("volume", "gridvolume", p_.at());
    set(grid, "name", "sigma_t", p_.at());
    const std::string file = p_.text("filename", "");
    if (file.empty()) p_.missing("filename");
    add(grid, "string", "filename", file, p_.at());
    add(grid, "string", "grid_name", p_.text("gridname", "density"), p_.at());
    place(grid, ctm_.to, p_.at());
    add(out, std::move(grid));
    add(out, "albedo", c.albedo, p_.at());
    add(out, "scale", p_.number("scale", 1) * c.extinction[0], p_.at());
    t_.warn_once(p_.at(),
                 "if this file has a grid \"temperature\", the light that pbrt gives off there is left "
                 "out");
    if (c.is_grey()) return true;
    p_.error(p_.at(), fmt::format("{}: sigma_a + sigma_s differs by channel, which a file's grid can't here",
                                  p_.title()));
    return false;
  }

  // Returns false if the bounds are wrong, which was reported.
  bool read_box() {
    for (std::size_t i = 0; i < 3; ++i) {
      sides_[i] = p_.integer(std::array{"nx", "ny", "nz"}[i], 1);
      if (sides_[i] < 1 || sides_[i] > kMaxSide)
        return p_.error(p_.at(), fmt::format("{} has {} values along a side; 1 to {} are read", p_.title(),
                                             sides_[i], kMaxSide)),
               false;
    }
    if ((std::size_t(sides_[0]) + 2) * (std::size_t(sides_[1]) + 2) * (std::size_t(sides_[2]) + 2) >
        kMaxVoxels)
      return p_.error(p_.at(), fmt::format("{} has more than {} voxels: give a file of \"nanovdb\"",
                                           p_.title(), kMaxVoxels)),
             false;
    low_ = p_.triple("p0", Vec3{{0, 0, 0}});
    high_ = p_.triple("p1", Vec3{{1, 1, 1}});
    for (std::size_t i = 0; i < 3; ++i)
      if (!(low_[i] < high_[i]))
        return p_.error(p_.at(), fmt::format("{}: p0 is not below p1 along all axes", p_.title())), false;
    return true;
  }

  std::size_t count() const {
    return std::size_t(sides_[0]) * std::size_t(sides_[1]) * std::size_t(sides_[2]);
  }

  // Surrounds the grid by a layer of zeros. In pbrt values are at the centres of voxels, and values outside
  // of the grid count as 0, so the density fades out over the last half voxel. The layer has the same effect.
  template <class F>
  MadeGrid padded(int channels, F value) const {
    MadeGrid g{{sides_[0] + 2, sides_[1] + 2, sides_[2] + 2}, channels, {}};
    const std::size_t c = std::size_t(channels);
    g.values.resize(std::size_t(g.sides[0]) * std::size_t(g.sides[1]) * std::size_t(g.sides[2]) * c);
    for (int z = 0; z < sides_[2]; ++z)
      for (int y = 0; y < sides_[1]; ++y)
        for (int x = 0; x < sides_[0]; ++x) {
          const std::size_t from =
              (std::size_t(z) * std::size_t(sides_[1]) + std::size_t(y)) * std::size_t(sides_[0]) +
              std::size_t(x);
          const std::size_t to = ((std::size_t(z) + 1) * std::size_t(g.sides[1]) + std::size_t(y) + 1) *
                                     std::size_t(g.sides[0]) +
                                 std::size_t(x) + 1;
          for (std::size_t k = 0; k < c; ++k) g.values[to * c + k] = static_cast<float>(value(from, k));
        }
    return g;
  }

  bool add_grid(Element& out, const char* name, const MadeGrid& grid) {
    const std::string file = keep_grid(t_, p_.at(), grid);
    Element volume = made("volume", "gridvolume", p_.at());
    set(volume, "name", name, p_.at());
    add(volume, "string", "filename", file, p_.at());
    Vec3 size, low;
    for (std::size_t i = 0; i < 3; ++i) {
      const double voxel = (high_[i] - low_[i]) / sides_[i];
      size[i] = voxel * grid.sides[i];
      low[i] = low_[i] - voxel * (grid.sides[i] - sides_[i]) / 2;
    }
    place(volume, multiply(ctm_.to, multiply(moved(low).to, scaled(size).to)), p_.at());
    add(out, std::move(volume));
    return !file.empty();
  }

  bool uniform_grid(Element& out) {
    const Coefficients c = coefficients();
    const Param* density = p_.take("density");
    if (!density) p_.missing("density");
    if (!read_box() || !density) return false;
    if (density->numbers.size() != count())
      return p_.error(density->at,
                      fmt::format("{} values, but nx * ny * nz is {}", density->numbers.size(), count())),
             false;
    const int channels = c.is_grey() ? 1 : 3;
    const MadeGrid grid = padded(channels, [&](std::size_t i, std::size_t k) {
      return density->numbers[i] * (channels == 1 ? 1 : c.extinction[k]);
    });
    add(out, "albedo", c.albedo, p_.at());
    add(out, "scale", p_.number("scale", 1) * (channels == 1 ? c.extinction[0] : 1), p_.at());
    return add_grid(out, "sigma_t", grid);
  }

  bool rgb_grid(Element& out) {
    const Param *a = p_.take("sigma_a"), *s = p_.take("sigma_s");
    if (!a && !s) p_.missing("sigma_s");
    if (!read_box() || (!a && !s)) return false;
    for (const Param* p : {a, s})
      if (p && p->numbers.size() != 3 * count())
        return p_.error(p->at, fmt::format("{} numbers, but 3 * nx * ny * nz is {}", p->numbers.size(),
                                           3 * count())),
               false;
    const auto at = [](const Param* p, std::size_t i) { return p ? p->numbers[i] : 1; };
    const MadeGrid extinction =
        padded(3, [&](std::size_t i, std::size_t k) { return at(a, 3 * i + k) + at(s, 3 * i + k); });
    MadeGrid albedo{sides_, 3, std::vector<float>(3 * count())};
    for (std::size_t i = 0; i < albedo.values.size(); ++i) {
      const double sum = at(a, i) + at(s, i);
      albedo.values[i] = static_cast<float>(sum > 0 ? at(s, i) / sum : 0);
    }
    t_.warn_once(p_.at(),
                 "of an \"rgbgrid\" extinction and albedo are interpolated between voxels, in pbrt "
                 "absorption and scattering");
    add(out, "scale", p_.number("scale", 1), p_.at());
    return add_grid(out, "sigma_t", extinction) && add_grid(out, "albedo", albedo);
  }

  Translation& t_;
  Params& p_;
  const Placed& ctm_;
  std::array<int, 3> sides_{};
  Vec3 low_, high_;
};

}  // namespace

std::string medium_id(const std::string& name) { return fmt::format("medium {}", name); }

void add_medium(Translation& t, const std::string& name, Params& p, const Placed& ctm) {
  auto medium = MediumTranslator(t, p, ctm).run();
  if (!medium) return;
  set(*medium, "id", medium_id(name), p.at());
  add(t.scene, std::move(*medium));
}

}  // namespace ls::scene::pbrt
