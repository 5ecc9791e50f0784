// Reports of jobs as HTML pages.
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

using PagesTest = ApiTest;

TEST_F(PagesTest, NeedNothingElseAndMayRunNothing) {
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

TEST_F(PagesTest, OfNoJobAreNotThere) {
  EXPECT_EQ(ask(Method::get, "/api/v1/jobs/j-99/report.html").status, 404);
  EXPECT_EQ(ask(Method::get, "/api/v1/jobs/" + submit() + "/report.html?frame=x").status, 400);
}

}  // namespace
}  // namespace ls::http::testing
