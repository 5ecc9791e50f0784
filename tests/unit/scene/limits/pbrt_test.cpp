// pbrt files at and beyond the size limits.
#include "common/scene/limits.h"
#include "tests/unit/scene/pbrt/pbrt_testing.h"

namespace ls {
namespace {

TEST(Pbrt, SizeIsLimited) {
  std::string many, grouped = "ObjectBegin \"o\" ";
  for (std::size_t i = 0; i <= scene::kMaxElements / 3; ++i) many += "Shape \"sphere\" ";

  EXPECT_NE(refusal(many).find("the scene is too large"), std::string::npos);
  EXPECT_NE(refusal(grouped + many).find("the scene is too large"), std::string::npos);
}

TEST(PbrtMedia, CloudsOfTooFineNoiseAreCoarser) {
  KeepingAssets assets;
  const ReadResult r =
      read_scene("t.pbrt", pbrt_scene(R"(MakeNamedMedium "m" "string type" "cloud" "float frequency" 3
"float wispiness" 0 "point3 p0" [ 0 1 0 ] "point3 p1" [ 2 2 2 ]
MediumInterface "m" "" Material "interface" Shape "sphere")"),
                 assets);

  ASSERT_TRUE(r.scene) << messages(r);
  EXPECT_NE(messages(r).find("along a cell of its finest noise, where 4 would be more exact"),
            std::string::npos);
  const std::size_t nodes = (assets.memory.files.at(r.scene->assets.at(0).name).size() - 48) / sizeof(float);
  EXPECT_LE(nodes, std::size_t{1} << 24);
  EXPECT_GT(nodes, std::size_t{1} << 23);
}

TEST(Pbrt, CornersOfTheirOwnAreLimited) {
  std::string corners = R"(Texture "t" "spectrum" "imagemap" "string filename" "wood.png"
Material "diffuse" "texture reflectance" "t"
Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  0 1 0 ] "integer indices" [ )";
  for (std::size_t i = 0; i <= (std::size_t{1} << 22) / 3; ++i) corners += "0 1 2 ";

  EXPECT_NE(refusal(corners + "]").find("more than 4194304 corners that need uv of their own"),
            std::string::npos);
}

}  // namespace
}  // namespace ls
