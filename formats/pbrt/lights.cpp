// Translates lights.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "formats/pbrt/object_translation.h"
#include "formats/xml/transform_element.h"

namespace ls::scene::pbrt {
namespace {

constexpr double kPi = std::numbers::pi;

Rgb times(const Rgb& c, double x) { return {c[0] * x, c[1] * x, c[2] * x}; }

class LightTranslator {
 public:
  LightTranslator(Translation& t, Params& p, const Placed& ctm) : t_(t), p_(p), ctm_(ctm) {}

  Element run() {
    const std::string_view type = p_.row().type;
    if (type == "point") return point();
    if (type == "spot") return spot();
    if (type == "distant") return distant();
    if (type == "projection") return projection();
    if (type == "goniometric") return goniometric();
    if (type == "infinite") read_portal();
    return p_.has("filename") || p_.has("mapname") ? image() : constant();
  }

 private:
  Rgb colour(std::string_view name) {
    return times(light_colour(t_, p_, name), p_.number("scale", 1) * t_.exposure());
  }

  // Returns the parameter if it is above 0, otherwise the fallback: pbrt ignores values of 0 or less.
  double above_zero(std::string_view name, double fallback) {
    const double x = p_.number(name, fallback);
    return x > 0 ? x : fallback;
  }

  // Returns the light's intensity I, scaled so that the light has the power that the file gives, if any.
  // `emitted`: the power that the light would have at intensity 1.
  Rgb intensity(double emitted) {
    const Rgb c = colour("I");
    const double power = above_zero("power", 0);
    if (!(power > 0)) return c;
    if (!(emitted > 0))
      p_.error(p_.at(), fmt::format("{} is too narrow to have a power: give I", p_.title()));
    return emitted > 0 ? times(c, power / emitted) : c;
  }

  Element point() {
    Element out = made("emitter", "point", p_.at());
    const Vec3 at = transform_point(ctm_.to, p_.triple("from", Vec3{{0, 0, 0}}));
    add(out, "point", "position", at, p_.at());
    add(out, "intensity", intensity(4 * kPi), p_.at());
    return out;
  }

  Element spot() {
    Element out = made("emitter", "spot", p_.at());
    const Vec3 from = p_.triple("from", Vec3{{0, 0, 0}}), to = p_.triple("to", Vec3{{0, 0, 1}});
    const Vec3 ahead = minus(to, from);
    const bool is_upright =
        std::abs(ahead[2]) > std::abs(ahead[0]) && std::abs(ahead[2]) > std::abs(ahead[1]);
    if (const auto aimed = looking(from, to, is_upright ? Vec3{{0, 1, 0}} : Vec3{{0, 0, 1}}))
      place(out, multiply(ctm_.to, aimed->from), p_.at());
    else
      p_.error(p_.at(), fmt::format("{} has from and to in one point", p_.title()));
    const double cutoff = p_.number("coneangle", 30), edge = p_.number("conedeltaangle", 5);
    if (edge < 0 || edge > cutoff)
      p_.error(p_.at(),
               fmt::format("{} has a conedeltaangle of {}, beyond 0 to coneangle", p_.title(), edge));
    else if (edge > 0)
      t_.warn_once(p_.at(),
                   "between coneangle - conedeltaangle and coneangle a spot falls off linearly in the angle "
                   "here, in pbrt as a smooth step of its cosine");
    add(out, "cutoff_angle", cutoff, p_.at());
    add(out, "beam_width", cutoff - edge, p_.at());
    const double end = std::cos(cutoff * kPi / 180), start = std::cos((cutoff - edge) * kPi / 180);
    add(out, "intensity", intensity(2 * kPi * ((1 - start) + (start - end) / 2)), p_.at());
    return out;
  }

  Element distant() {
    Element out = made("emitter", "directional", p_.at());
    const Vec3 from = p_.triple("from", Vec3{{0, 0, 0}}), to = p_.triple("to", Vec3{{0, 0, 1}});
    const Vec3 way = transform_vector(ctm_.to, minus(to, from));
    add(out, "vector", "direction", way, p_.at());
    add(out, "irradiance", times(colour("L"), above_zero("illuminance", 1)), p_.at());
    return out;
  }

  Element image_texture(const char* name) {  // the light's image, as our parameter `name`
    const std::string file = p_.text("filename", "");
    if (file.empty()) p_.missing("filename");
    Element out = made("texture", "bitmap", p_.at());
    set(out, "name", name, p_.at());
    add(out, "string", "filename", file, p_.at());
    add(out, "string", "filter_type", "nearest", p_.at());
    add(out, "string", "wrap_mode", "clamp", p_.at());
    return out;
  }

  Element goniometric() {
    Element out = made("emitter", "goniometric", p_.at());
    // The middle of the image is in the direction of the light's +y axis in pbrt, and of its +z axis here.
    const Transform axes{{1, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 1}};
    place(out, multiply(ctm_.to, axes), p_.at());
    add(out, "intensity", colour("I"), p_.at());
    add(out, image_texture("texture"));
    return out;
  }

  // Ignores the portal, with a warning. In pbrt the map is visible only through the portal, here in all
  // directions. In a closed room with the portal as its only opening this is the same, since the walls hide
  // the rest of the map.
  void read_portal() {
    if (!p_.has("portal")) return;
    const Param* portal = p_.take("portal");
    if (!portal) return;
    if (portal->numbers.size() != 12)
      return p_.error(portal->at, fmt::format("'portal' of {} has {} numbers: give the 12 of its 4 corners",
                                              p_.title(), portal->numbers.size()));
    t_.report.warning(portal->at,
                      fmt::format("'portal' of {} is ignored: pbrt shows the light only through the portal, "
                                  "here it comes from all directions. Both are the same "
                                  "in a closed room whose only opening is the portal",
                                  p_.title()));
  }

  Element constant() {
    Element out = made("emitter", "constant", p_.at());
    add(out, "radiance", times(colour("L"), above_zero("illuminance", kPi) / kPi), p_.at());
    return out;
  }

  Element image() {
    Element out = made("emitter", "envmap", p_.at());
    if (above_zero("illuminance", 0) > 0)
      p_.error(p_.at(), fmt::format("{} has an illuminance, which depends on its image's pixels: give scale",
                                    p_.title()));
    // In pbrt-v3 the image is called mapname, and is multiplied by L. In pbrt-v4 it is called filename, and L
    // is an error. So if there is a filename, L and mapname are not taken here, and finish() reports them as
    // errors.
    const bool is_square = p_.has("filename");
    const Rgb c = is_square ? times({1, 1, 1}, p_.number("scale", 1) * t_.exposure()) : colour("L");
    add(out, "string", "filename", p_.text(is_square ? "filename" : "mapname", ""), p_.at());
    add(out, "scale", c[0], p_.at());
    if (!is_grey(c))
      p_.error(p_.at(), fmt::format("{} tints its image by L: do that to the image itself", p_.title()));
    if (is_square) {
      add(out, "string", "mapping", "equal_area", p_.at());
      place(out, ctm_.to, p_.at());
      return out;
    }
    // Maps pbrt's axes to ours. In pbrt the top row is +z, the left edge +x, and a quarter further is +y; in
    // our maps these are +y, -z and +x.
    const Transform axes{{0, 0, -1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1}};
    place(out, multiply(ctm_.to, axes), p_.at());
    return out;
  }

  // As for our cameras, +x of our projector points to the left of the image, in pbrt to the right. So x is
  // mirrored.
  Element projection() {
    Element out = made("emitter", "projector", p_.at());
    add(out, image_texture("irradiance"));
    add(out, "scale", p_.number("scale", 1) * t_.exposure(), p_.at());
    add(out, "fov", p_.number("fov", 90), p_.at());
    add(out, "string", "fov_axis", "smaller", p_.at());
    add(out, "boolean", "as_intensity", "true", p_.at());
    place(out, multiply(without_scale(ctm_.to).rigid, scaled(Vec3{{-1, 1, 1}}).to), p_.at());
    return out;
  }

  Translation& t_;
  Params& p_;
  const Placed& ctm_;
};

}  // namespace

void add_light(Translation& t, Params& p, const Placed& ctm) {
  Element light = LightTranslator(t, p, ctm).run();
  p.finish();
  add(t.scene, std::move(light));
}

AreaLight area_light(Translation& t, Params& p) {
  const Rgb c = times(light_colour(t, p, "L"), p.number("scale", 1) * t.exposure());
  std::optional<double> power;
  // pbrt ignores a power of 0 or less.
  if (const double given = p.has("power") ? p.number("power", 0) : 0; given > 0) power = given;
  const bool two_sided = p.boolean("twosided", false);
  p.finish();
  return {c, power, two_sided, p.at()};
}

}  // namespace ls::scene::pbrt
