#include "tests/property/draw.h"

#include <algorithm>

namespace ls::test {

Rgb Draw::colour(const scene::Range& range) {
  if (dice_.chance(.4)) {
    const double grey = number(range);
    return {grey, grey, grey};
  }
  Rgb c;
  for (double& x : c) x = number(range);
  return c;
}

Transform Draw::placement(double size, bool alike) {
  Vec3 at, by;
  for (double& x : at) x = 1.3 * dice_.gauss();
  const double all = size * dice_.magnitude(.3, 1.5);
  for (double& x : by) x = alike ? all : size * dice_.magnitude(.3, 1.5);
  if (dice_.chance(.1)) by[0] = -by[0];
  if (wild()) {
    const double k = dice_.extreme({1e-30, 1e30});
    for (double& x : by) x *= k;
  }
  if (wild()) at[dice_.below(3)] = dice_.extreme({-1e12, 1e12});
  if (!alike && wild()) by[dice_.below(3)] = dice_.extreme({1e-12, 1e12});
  const Transform turn =
      dice_.chance(.3) ? Transform{} : rotate_x(dice_.between(0, 360)) * rotate_y(dice_.between(0, 360));
  return translate(at) * turn * scale(by[0], by[1], by[2]);
}

TextureIndex Draw::texture(const scene::Range& range, int depth) {
  Texture t = ConstantTexture{colour(range)};
  const double kind = dice_.unit();
  if (kind < .15) {
    BitmapTexture b;
    fill(b);
    b.file = SceneBuilder::push<AssetTag>(scene_.assets, random_image(dice_, assets_, choice_.wild));
    t = b;
  } else if (kind < .3 && depth < 3) {
    CheckerboardTexture c;
    fill(c);
    // The fields' own ranges are wider than those of what the texture is for.
    c.color0 = texture(range, depth + 1);
    c.color1 = texture(range, depth + 1);
    t = c;
  } else if (kind < .34 && depth < 3) {
    PeakTexture p;
    fill(p);
    p.texture = texture(range, depth + 1);
    t = p;
  }
  return SceneBuilder::push<TextureTag>(scene_.textures, t);
}

BsdfIndex Draw::bsdf(int depth) {
  const int outer = std::exchange(depth_, depth);
  Bsdf b;
  do {
    any(b);
  } while (depth > 2 && scene::nested_bsdfs(b)[0]);
  const auto diffuse = [&] {
    return SceneBuilder::push<BsdfTag>(scene_.bsdfs, DiffuseBsdf{texture(scene::kUnit)});
  };
  if (auto* two = std::get_if<TwoSidedBsdf>(&b)) {
    const auto traits = *scene::bsdf_traits(scene_);
    for (BsdfIndex* side : {&two->front, &two->back})
      if (traits[side->value].transmits || traits[side->value].two_sided) *side = diffuse();
  }
  if (auto* mask = std::get_if<MaskBsdf>(&b)) {
    // Of an image its alpha channel may be meant: no other use of it is.
    auto* image = std::get_if<BitmapTexture>(&scene_.textures[mask->opacity.value]);
    if (image && image->channel == Channel::all) image->alpha = true;
  }
  if (auto* p = std::get_if<PrincipledBsdf>(&b); p && p->spec_trans) {
    // A share of nothing is not given.
    const auto* share = std::get_if<ConstantTexture>(&scene_.textures[p->spec_trans->value]);
    if (share && share->value == Rgb{0, 0, 0}) p->spec_trans.reset();
  }
  if (auto* sheet = std::get_if<DiffuseTransmissionBsdf>(&b)) share_light(*sheet);
  constexpr Rgb kGreys[] = {{.1, .1, .1}, {.4, .4, .4}, {1, 1, 1}};
  // Energy that facets pass on to each other is tabulated for one roughness, which takes a while to build.
  std::visit(
      [&](auto& rough) {
        if constexpr (requires { rough.multiple_scattering; }) {
          if (dice_.chance(.8)) rough.multiple_scattering = false;
          if constexpr (requires { rough.alpha_u; })
            if (rough.multiple_scattering)
              rough.alpha_u = rough.alpha_v =
                  SceneBuilder::push<TextureTag>(scene_.textures, ConstantTexture{kGreys[dice_.below(3)]});
          if constexpr (requires { rough.anisotropic; })
            if (rough.multiple_scattering)
              rough.anisotropic = SceneBuilder::push<TextureTag>(scene_.textures, ConstantTexture{{0, 0, 0}});
        }
      },
      b);
  if (auto* bump = std::get_if<BumpMapBsdf>(&b)) {
    BitmapTexture heights;
    heights.file = SceneBuilder::push<AssetTag>(scene_.assets, random_image(dice_, assets_, choice_.wild));
    heights.raw = true;
    bump->texture = SceneBuilder::push<TextureTag>(scene_.textures, heights);
  }
  depth_ = outer;
  return SceneBuilder::push<BsdfTag>(scene_.bsdfs, b);
}

// Makes a sheet whose colours are constant send on no more light than it gets.
void Draw::share_light(DiffuseTransmissionBsdf& sheet) {
  const auto* back = std::get_if<ConstantTexture>(&scene_.textures[sheet.reflectance.value]);
  const auto* through = std::get_if<ConstantTexture>(&scene_.textures[sheet.transmittance.value]);
  if (!back || !through) return;
  ConstantTexture rest;
  for (std::size_t i = 0; i < 3; ++i) rest.value[i] = (1 - back->value[i]) * through->value[i];
  sheet.transmittance = SceneBuilder::push<TextureTag>(scene_.textures, rest);
}

VolumeIndex Draw::volume(GridKind kind) {
  const double c = dice_.unit();
  if (c < .3) {
    ConstVolume v;
    v.value = colour(kind == GridKind::share ? scene::kUnit : scene::kNonNegative);
    if (kind == GridKind::temperature) v.value = Rgb{v.value[0] * 800, v.value[0] * 800, v.value[0] * 800};
    if (kind == GridKind::density) v.to_world = translate({-1, -1, -1}) * ls::test::scale(2);
    return SceneBuilder::push<VolumeTag>(scene_.volumes, v);
  }
  if (c < .45) return computed_volume(kind);
  GridVolume g;
  fill(g);
  const bool bin = c > .85;
  g.file = SceneBuilder::push<AssetTag>(scene_.assets, bin ? random_bin(dice_, assets_, choice_.wild, kind)
                                                           : random_vol(dice_, assets_, choice_.wild, kind));
  if (!bin) g.order = GridOrder::x_fastest;
  if (bin) g.raw = true;
  // A border takes three values along each axis, which random grids may not have.
  g.border = false;
  if (bin || g.node_centred) g.wrap = Wrap::clamp;
  if (dice_.chance(.7)) g.to_world = translate({-1, -1, -1}) * ls::test::scale(2);
  return SceneBuilder::push<VolumeTag>(scene_.volumes, g);
}

// A volume that has a box, and no values above 1 (temperatures: 1600).
VolumeIndex Draw::computed_volume(GridKind kind) {
  const auto push = [&](const Volume& v) { return SceneBuilder::push<VolumeTag>(scene_.volumes, v); };
  const auto place = [&](auto& v) {
    fill(v);
    v.min = {-.9, -.8, -.9};
    v.max = {.9, .7, .8};
    v.to_world = placement(1, false);
  };
  NoiseVolume noise;
  place(noise);
  noise.high = std::min(noise.high, 1.);
  noise.low = wild() ? std::min(noise.low, 1.) : dice_.between(-1, .5);
  VolumeIndex made = push(noise);
  if (dice_.chance(.3)) {
    CloudVolume cloud;
    place(cloud);
    made = push(cloud);
  }
  if (dice_.chance(.5)) {
    HeightFogVolume fog;
    fill(fog);
    fog.value = std::min(fog.value, 1.);
    fog.ground_normal = {.2, 1, -.3};
    const VolumeIndex second = dice_.chance(.5) ? push(fog) : made;
    made = push(ProductVolume{made, second});
  }
  if (kind == GridKind::temperature || dice_.chance(.4)) {
    RemapVolume r{made};
    r.in_low = dice_.between(0, .3);
    r.in_high = r.in_low + dice_.between(.1, 1);
    r.gamma = dice_.between(.3, 3);
    r.out_low = dice_.unit();
    if (dice_.chance(.5)) {
      r.positions = {.2, .5, .6};
      r.values = {dice_.unit(), dice_.unit(), dice_.unit()};
    }
    if (kind == GridKind::temperature) {
      r.out_low *= 800;
      r.out_high = 1600;
    }
    made = push(r);
  }
  return made;
}

// Gives the medium a density that falls with height, and makes its other volumes constant.
void Draw::fill_with_height_fog(HeterogeneousMedium& m) {
  HeightFogVolume fog;
  fill(fog);
  fog.ground_normal = {dice_.between(-1, 1), 1, dice_.between(-1, 1)};
  const auto constant = [&](double most) {
    const double v = most * dice_.unit();
    return SceneBuilder::push<VolumeTag>(scene_.volumes, ConstVolume{{v, v, v}, {}});
  };
  m.sigma_t = SceneBuilder::push<VolumeTag>(scene_.volumes, fog);
  m.albedo = constant(1);
  m.emission.reset();
  if (m.source_radiance) m.source_radiance = constant(1);
  if (m.temperature) m.temperature = constant(1500);
  if (m.emission_weight) m.emission_weight = constant(1);
}

PhaseIndex Draw::phase(int depth) {
  const int outer = std::exchange(phase_depth_, depth);
  Phase p;
  do {
    any(p);
  } while (depth > 2 && std::holds_alternative<BlendPhase>(p));
  if (auto* table = std::get_if<TabulatedPhase>(&p)) {
    const std::size_t n = 2 + dice_.below(5);
    const auto values = [&] {
      std::vector<double> list(n, 0);
      for (double& v : list)
        if (dice_.chance(.7)) v = number(scene::kUnit);
      list[dice_.below(n)] = 1;
      return list;
    };
    *table = {};
    if (dice_.chance(.5))
      table->values = values();
    else
      table->red = values(), table->green = values(), table->blue = values();
    if (dice_.chance(.5))
      for (std::size_t i = 0; i < n; ++i)
        table->angles.push_back(180 * static_cast<double>(i * i) / static_cast<double>((n - 1) * (n - 1)));
  }
  if (auto* blend = std::get_if<BlendPhase>(&p)) {
    const double share = number(scene::kUnit);
    blend->weight = SceneBuilder::push<VolumeTag>(scene_.volumes, ConstVolume{{share, share, share}, {}});
  }
  phase_depth_ = outer;
  return SceneBuilder::push<PhaseTag>(scene_.phases, p);
}

MediumIndex Draw::medium() {
  Medium m;
  any(m);
  if (auto* h = std::get_if<HeterogeneousMedium>(&m)) {
    if (dice_.chance(.2)) fill_with_height_fog(*h);
    // At most one source of light, and none of their factors without it.
    const std::size_t keep = dice_.below(4);
    if (keep != 0) h->emission.reset();
    if (keep != 1) h->source_radiance.reset();
    if (keep != 2) h->temperature.reset();
    if (!h->emission && !h->source_radiance && !h->temperature) h->emission_scale = 1;
    if (!h->temperature) {
      h->temperature_scale = 1;
      h->temperature_offset = 0;
      h->peak_one = false;
      h->emission_weight.reset();
    }
    // A density of three channels has colours of its own.
    if (std::holds_alternative<GridVolume>(scene_.volumes[h->sigma_t.value])) h->tint = {1, 1, 1};
  }
  return SceneBuilder::push<MediumTag>(scene_.media, m);
}

}  // namespace ls::test
