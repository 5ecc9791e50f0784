#include "coordinator/http/api/page_bundle.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <regex>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/digest.h"

namespace ls::http {
namespace {

using Sources = std::map<std::string, std::string_view, std::less<>>;

std::string_view text_of(const StaticFile& file) {
  return {reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()};
}

std::string digest_of(const std::string& text) {
  return sha256(std::as_bytes(std::span(text))).hex().substr(0, 16);
}

template <typename Line>  // Line(std::string_view)
void each_line(std::string_view text, const Line& line) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    line(text.substr(0, end + 1));
    text.remove_prefix(end + 1);
  }
}

// Each module becomes a function that is called once and returns what it exports. What a module imports
// stands before it.
class Joined {
 public:
  explicit Joined(const Sources& sources) : sources_(sources) {}

  // False: the module, or one that it imports, is written in a way that is not known here.
  bool add(const std::string& name) {
    if (const auto before = done_.find(name); before != done_.end()) return before->second;
    const auto source = sources_.find(name);
    if (source == sources_.end()) return false;
    done_[name] = false;  // until it is there: modules that import each other in a circle can't be joined
    std::string body;
    std::vector<std::string> exported;
    bool known = true;
    each_line(source->second, [&](std::string_view line) {
      known = known && add_line(name, std::string(line), body, exported);
    });
    if (!known) return false;
    text_ += fmt::format("modules[\"{}\"] = (() => {{\n{}\nreturn {{ {} }};\n}})();\n", name, body,
                         fmt::join(exported, ", "));
    return done_[name] = true;
  }

  std::string text() const { return "const modules = {};\n" + text_; }

 private:
  bool add_line(const std::string& name, std::string line, std::string& body,
                std::vector<std::string>& exported) {
    static const std::regex kImport(R"re(import (?:\{ (.*) \} from )?"(\.[^"]*)";\s*)re");
    static const std::regex kExport(R"(^export (?:const|function|async function|class) (\w+))");
    static const std::regex kAs(R"((\w+) as (\w+))");
    static const std::regex kOwnAddress(R"(import\.meta\.url)");
    std::smatch parts;
    if (line.starts_with("import ")) {
      if (!std::regex_match(line, parts, kImport)) return false;
      const auto from =
          (std::filesystem::path(name).parent_path() / parts[2].str()).lexically_normal().generic_string();
      if (!add(from)) return false;
      if (parts[1].matched)
        body += fmt::format("const {{ {} }} = modules[\"{}\"];\n",
                            std::regex_replace(parts[1].str(), kAs, "$1: $2"), from);
      return true;
    }
    if (line.starts_with("export ")) {
      if (!std::regex_search(line, parts, kExport)) return false;
      exported.push_back(parts[1]);
      line.erase(0, std::string_view("export ").size());
    }
    if (line.find("import.meta") != std::string::npos)
      line = std::regex_replace(line, kOwnAddress, fmt::format("new URL(\"{}\", document.baseURI)", name));
    body += line;
    return true;
  }

  const Sources& sources_;
  std::map<std::string, bool, std::less<>> done_;  // true: its text stands in text_
  std::string text_;
};

}  // namespace

std::optional<PageBundle> bundle_page(std::span<const StaticFile> files) {
  Sources sources;
  for (const StaticFile& file : files) sources.emplace(file.name, text_of(file));
  const auto page = sources.find("index.html");
  if (page == sources.end()) return std::nullopt;
  static const std::regex kStyle(R"re(\s*<link rel="stylesheet" href="([^"]+)">\s*)re");
  static const std::regex kScript(R"re(\s*<script type="module" src="([^"]+)"></script>\s*)re");
  PageBundle bundle;
  Joined joined(sources);
  bool known = true, styled = false, scripted = false;
  each_line(page->second, [&](std::string_view view) {
    const std::string line(view);
    std::smatch parts;
    if (std::regex_match(line, parts, kStyle)) {
      const auto style = sources.find(parts[1].str());
      known = known && style != sources.end();
      if (known) bundle.style += style->second;
      if (!std::exchange(styled, true)) bundle.page += "  <link rel=\"stylesheet\" href=\"{style}\">\n";
    } else if (std::regex_match(line, parts, kScript)) {
      known = known && !std::exchange(scripted, true) && joined.add(parts[1]);
      bundle.page += "  <script type=\"module\" src=\"{script}\"></script>\n";
    } else {
      bundle.page += line;
    }
  });
  if (!known || !styled || !scripted) return std::nullopt;
  bundle.script = joined.text();
  bundle.style_name = fmt::format("dashboard.{}.css", digest_of(bundle.style));
  bundle.script_name = fmt::format("dashboard.{}.js", digest_of(bundle.script));
  const auto put = [&](std::string_view mark, const std::string& name) {
    bundle.page.replace(bundle.page.find(mark), mark.size(), name);
  };
  put("{style}", bundle.style_name);
  put("{script}", bundle.script_name);
  return bundle;
}

}  // namespace ls::http
