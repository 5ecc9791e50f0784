// The dashboard's modules joined to one file, and bodies in gzip.
#include "coordinator/http/api/page_bundle.h"

#include <zlib.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <tuple>

#include "coordinator/http/api/content_coding.h"
#include "tests/unit/http/fixture.h"

namespace ls::http::testing {
namespace {

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

constexpr std::string_view kIndex =
    "<head>\n  <link rel=\"stylesheet\" href=\"css/a.css\">\n  <link rel=\"stylesheet\" href=\"css/b.css\">\n"
    "  <script type=\"module\" src=\"js/main.js\"></script>\n</head>\n";

std::optional<PageBundle> bundled(std::string_view main, std::string_view other = "export const x = 1;\n") {
  const StaticFile files[] = {{"index.html", bytes_of(kIndex)},
                              {"css/a.css", bytes_of("a {}\n")},
                              {"css/b.css", bytes_of("b {}\n")},
                              {"js/main.js", bytes_of(main)},
                              {"js/deep/other.js", bytes_of(other)}};
  return bundle_page(files);
}

std::string unpacked(std::string_view gzip) {
  std::string out(1 << 20, '\0');
  z_stream stream{};
  EXPECT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(gzip.data()));
  stream.avail_in = static_cast<uInt>(gzip.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return out;
}

TEST(PageBundle, JoinsModulesInTheOrderInWhichTheyNeedEachOther) {
  const auto bundle = bundled(
      "import \"./deep/other.js\";\nimport { x as y } from \"./deep/other.js\";\nexport function f() { "
      "return y; }\n",
      "export const x = 1;\nconst here = new URL(\"./w.js\", import.meta.url);\n");
  ASSERT_TRUE(bundle);

  ASSERT_EQ(bundle->scripts.size(), 1U);
  EXPECT_EQ(
      bundle->scripts[0].text,
      "export const modules = {};\n"
      "modules[\"js/deep/other.js\"] = (() => {\nconst x = 1;\nconst here = new URL(\"./w.js\", new "
      "URL(\"js/deep/other.js\", document.baseURI));\n\nreturn { x };\n})();\n"
      "modules[\"js/main.js\"] = (() => {\nconst { x: y } = modules[\"js/deep/other.js\"];\nfunction f() { "
      "return y; }\n\nreturn { f };\n})();\n");
  EXPECT_EQ(bundle->style.text, "a {}\nb {}\n");
  EXPECT_EQ(bundle->page, "<head>\n  <link rel=\"stylesheet\" href=\"" + bundle->style.name +
                              "\">\n  <script type=\"module\" src=\"" + bundle->scripts[0].name +
                              "\"></script>\n</head>\n");
}

TEST(PageBundle, HasEachModuleOnceInTheFirstScriptThatNeedsIt) {
  constexpr std::string_view kPage =
      "  <script type=\"module\" async src=\"js/early.js\"></script>\n"
      "  <link rel=\"stylesheet\" href=\"css/a.css\">\n"
      "  <script type=\"module\" src=\"js/main.js\"></script>\n";
  const StaticFile files[] = {
      {"index.html", bytes_of(kPage)},
      {"css/a.css", bytes_of("a {}\n")},
      {"js/shared.js", bytes_of("export const x = 1;\n")},
      {"js/early.js", bytes_of("import { x } from \"./shared.js\";\n")},
      {"js/main.js", bytes_of("import { x } from \"./shared.js\";\nimport \"./early.js\";\n")}};
  const auto bundle = bundle_page(files);
  ASSERT_TRUE(bundle && bundle->scripts.size() == 2);
  const auto& [early, main] = std::tie(bundle->scripts[0], bundle->scripts[1]);

  EXPECT_NE(early.text.find("modules[\"js/shared.js\"] = "), std::string::npos);
  EXPECT_NE(early.text.find("modules[\"js/early.js\"] = "), std::string::npos);
  EXPECT_EQ(main.text, "import { modules } from \"./" + early.name +
                           "\";\nmodules[\"js/main.js\"] = (() => {\nconst { x } = "
                           "modules[\"js/shared.js\"];\n\nreturn {  };\n})();\n");
  EXPECT_NE(bundle->page.find("<script type=\"module\" async src=\"" + early.name), std::string::npos);
}

TEST(PageBundle, LeavesCommentsOut) {
  const auto bundle = bundled(
      "// one line\nconst a = \"http://x\"; // behind code\n/**\n * const b = 1;\n */\n  /** c */\nf(a);\n");
  ASSERT_TRUE(bundle);

  EXPECT_NE(bundle->scripts[0].text.find("{\nconst a = \"http://x\"; // behind code\nf(a);\n\n"),
            std::string::npos)
      << bundle->scripts[0].text;
}

TEST(PageBundle, NamesFilesByTheirContent) {
  const auto one = bundled("import \"./deep/other.js\";\n");
  const auto same = bundled("import \"./deep/other.js\";\n");
  const auto other = bundled("import \"./deep/other.js\";\n", "export const x = 2;\n");
  ASSERT_TRUE(one && same && other);

  EXPECT_EQ(one->scripts[0].name, same->scripts[0].name);
  EXPECT_NE(one->scripts[0].name, other->scripts[0].name);
  EXPECT_EQ(one->style.name, other->style.name);
}

TEST(PageBundle, LeavesUnknownContentUnchanged) {
  for (const std::string_view main :
       {"import * as all from \"./deep/other.js\";\n", "import \"./missing.js\";\n", "export default 1;\n",
        "export { x };\n", "import \"./main.js\";\n"})
    EXPECT_FALSE(bundled(main)) << main;
}

TEST(PageBundle, ContainsAllDashboardModulesExceptThoseLoadedWhenNeeded) {
  // By FLIP's worker, and for pictures with light groups
  const std::set<std::string_view> later = {"js/viewer/flip_worker.js",  "js/viewer/flip.js",
                                            "js/viewer/mixing.js",       "js/viewer/mix.js",
                                            "js/viewer/mixed_source.js", "js/viewer/mix_panel.js"};
  const auto bundle = bundle_page(embedded_files());
  ASSERT_TRUE(bundle) << "a module of web/static/js is written in a way that page_bundle.h does not name";

  for (const StaticFile& file : embedded_files()) {
    const bool module = file.name.starts_with("js/") && file.name.ends_with(".js");
    if (!module || later.contains(file.name)) continue;
    const std::string begin = "modules[\"" + std::string(file.name) + "\"] = ";
    EXPECT_EQ(std::ranges::count_if(
                  bundle->scripts,
                  [&](const JoinedFile& script) { return script.text.find(begin) != script.text.npos; }),
              1)
        << file.name;
  }
}

TEST(StaticFiles, AreCompressedForClientsThatAcceptItAndCachedByTheirDigest) {
  const StaticFiles files(embedded_files());
  const auto bundle = bundle_page(embedded_files());
  ASSERT_TRUE(bundle);

  const auto plain = files.find(request(Method::get, "/" + bundle->scripts.back().name));
  const auto gzip =
      files.find(request(Method::get, "/" + bundle->scripts.back().name, {{"accept-encoding", "br, gzip"}}));
  ASSERT_TRUE(plain && gzip);
  const auto text = [](const Response& r) {
    return std::string(reinterpret_cast<const char*>(r.bytes().data()), r.bytes().size());
  };

  EXPECT_EQ(text(*plain), bundle->scripts.back().text);
  EXPECT_EQ(unpacked(text(*gzip)), bundle->scripts.back().text);
  EXPECT_LT(3 * gzip->length(), plain->length());
  const auto field = [](const Response& r, std::string_view name) {
    const auto found = std::ranges::find(r.headers, name, &Fields::value_type::first);
    return found == r.headers.end() ? std::string() : found->second;
  };
  EXPECT_EQ(field(*gzip, "Content-Encoding"), "gzip");
  EXPECT_EQ(field(*plain, "Content-Encoding"), "");
  EXPECT_NE(field(*plain, "ETag"), field(*gzip, "ETag"));
  EXPECT_NE(field(*gzip, "Cache-Control").find("immutable"), std::string::npos);
  EXPECT_EQ(field(*files.find(request(Method::get, "/")), "Cache-Control"), "no-cache");
  EXPECT_EQ(files
                .find(request(Method::get, "/",
                              {{"if-none-match", field(*files.find(request(Method::get, "/")), "ETag")}}))
                ->status,
            304);
}

TEST(ContentCoding, IsGzipOnlyIfAccepted) {
  for (const auto& [field, takes] : {std::pair{"gzip", true},
                                     {"br;q=1, GZIP ; q=0.5", true},
                                     {"gzip;q=0", false},
                                     {"gzip;q=0.000", false},
                                     {"", false},
                                     {"deflate, x-gzip", false}})
    EXPECT_EQ(accepts_gzip(request(Method::get, "/", {{"accept-encoding", field}})), takes) << field;
}

TEST(ContentCoding, LeavesShortAnswersAndImagesUncompressed) {
  const Request asks = request(Method::get, "/", {{"accept-encoding", "gzip"}});
  const std::string words(10000, 'a');
  Response shorter = json_response(200, "{}"), picture = text_response(200, "image/png", words),
           list = json_response(200, words);
  for (Response* response : {&shorter, &picture, &list}) compress(*response, asks);

  EXPECT_EQ(std::get<std::string>(shorter.body), "{}");
  EXPECT_EQ(std::get<std::string>(picture.body), words);
  EXPECT_EQ(unpacked(std::get<std::string>(list.body)), words);
}

}  // namespace
}  // namespace ls::http::testing
