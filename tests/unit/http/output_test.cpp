// The output of jobs over HTTP: layers of an image as numbers, and the report as an HTML page.
#include <cmath>
#include <cstring>

#include "core/image/exr/pixel_layers.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using nlohmann::json;

class Pixels : public ApiTest {
 protected:
  std::vector<float> floats(const Response& r) const {
    return layer_floats(pixel_layer({}, "rgb").value(), r.bytes());
  }
};

TEST_F(Pixels, ComeAsHalfFloatsWhileTheJobRendersAndAfterwards) {
  const std::string id = submit(), url = "/api/v1/jobs/" + id;
  const Response before = ask(Method::get, url + "/pixels?rect=0,0,40,24");
  FakeFarm farm(*coordinator, 1);
  ASSERT_TRUE(farm.finish({id}));

  const Response after = ask(Method::get, url + "/pixels?layer=rgb&level=1&rect=2,0,20,12");

  ASSERT_EQ(before.status, 200);
  ASSERT_EQ(before.bytes().size(), 40u * 24 * 3 * 2);
  for (const float value : floats(before)) ASSERT_TRUE(std::isnan(value));
  EXPECT_EQ(after.content_type, "application/octet-stream");
  ASSERT_EQ(after.bytes().size(), 18u * 12 * 3 * 2);
  for (const float value : floats(after)) ASSERT_GE(value, 0);
}

TEST_F(Pixels, EveryListedLayerHasPixels) {
  const std::string url = "/api/v1/jobs/" + submit("?aov=depth,shape_id,normal");

  const json layers = json_of(ask(Method::get, url + "/layers"));

  EXPECT_EQ(layers["size"], json({40, 24}));
  std::vector<std::string> names;
  for (const auto& layer : layers["layers"]) {
    names.push_back(layer["name"]);
    const Response r = ask(Method::get, url + "/pixels?rect=0,0,3,2&layer=" + names.back());
    EXPECT_EQ(r.bytes().size(), 6 * layer["channels"].size() * (layer["format"] == "half" ? 2 : 4));
  }
  EXPECT_EQ(names,
            (std::vector<std::string>{"rgb", "stderr", "error", "spp", "depth", "normal", "crypto_object"}));
  EXPECT_EQ(layers["layers"][6]["names"].size(), 1u) << "the sphere";
}

TEST_F(Pixels, PixelsOutsideTheImageAreRefusedWithItsBounds) {
  const std::string url = "/api/v1/jobs/" + submit() + "/pixels";
  for (const char* wrong :
       {"", "?rect=0,0,1", "?rect=0,0,1,1,1", "?rect=a,0,1,1", "?rect=-1,0,1,1", "?rect=0,0,41,24",
        "?rect=1,1,1,2", "?rect=0,0,99999999999,1", "?rect=0,0,21,12&level=1", "?rect=0,0,1,1&level=11",
        "?rect=0,0,1,1&level=x", "?rect=0,0,1,1&level=-1", "?rect=0,0,1,1&layer=depth"}) {
    const Response r = ask(Method::get, url + wrong);
    EXPECT_EQ(r.status, 400) << wrong;
  }
  EXPECT_NE(text(ask(Method::get, url + "?rect=0,0,41,24")).find("0,0,40,24"), std::string::npos);
  EXPECT_NE(text(ask(Method::get, url + "?rect=0,0,1,1&layer=x")).find("rgb, stderr, error, spp"),
            std::string::npos);
}

using PagesTest = ApiTest;

TEST_F(PagesTest, AreSelfContainedAndRunNoScripts) {
  const std::string job = submit();
  ASSERT_TRUE(FakeFarm(*coordinator, 1).finish({job}));

  const Response page = ask(Method::get, "/api/v1/jobs/" + job + "/report.html");

  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.content_type, "text/html; charset=utf-8");
  EXPECT_NE(text(page).find("Samples per pixel</dt><dd><b>16</b>"), std::string::npos);
  EXPECT_NE(text(page).find("src=\"data:image/png;base64,"), std::string::npos);
  std::string policy;
  for (const auto& [name, value] : page.headers)
    if (name == "Content-Security-Policy") policy += value;
  EXPECT_EQ(policy.find("default-src 'none'; img-src data:; style-src 'sha256-"), 0u) << policy;
  EXPECT_EQ(policy.find("unsafe"), std::string::npos);
  EXPECT_NE(policy.find("frame-ancestors 'none'"), std::string::npos);
}

TEST_F(PagesTest, UnknownJobHasNoPage) {
  EXPECT_EQ(ask(Method::get, "/api/v1/jobs/j-99/report.html").status, 404);
  EXPECT_EQ(ask(Method::get, "/api/v1/jobs/" + submit() + "/report.html?frame=x").status, 400);
}

}  // namespace
}  // namespace ls::http::testing
