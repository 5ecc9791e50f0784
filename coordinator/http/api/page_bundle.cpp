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

JoinedFile joined_file(std::string_view ending, std::string text) {
  const std::string digest = sha256(std::as_bytes(std::span(text))).hex().substr(0, 16);
  return {fmt::format("dashboard.{}.{}", digest, ending), std::move(text)};
}

template <typename Line>  // Line(std::string_view)
void each_line(std::string_view text, const Line& line) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size() - 1);
    line(text.substr(0, end + 1));
    text.remove_prefix(end + 1);
  }
}

// True if the line belongs to a comment, which has its lines for itself. `open`: a comment that began before
// goes on; set for the next line.
bool is_comment(std::string_view line, bool& open) {
  line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
  const bool block = open || line.starts_with("/*");
  if (block) open = line.find("*/") == std::string_view::npos;
  return block || line.starts_with("//");
}

// Each module becomes a function that is called once and returns what it exports. What a module imports
// stands before it, or in an earlier script.
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
    bool known = true, comment = false;
    each_line(source->second, [&](std::string_view line) {
      known = known && (is_comment(line, comment) || add_line(name, std::string(line), body, exported));
    });
    if (!known) return false;
    text_ += fmt::format("modules[\"{}\"] = (() => {{\n{}\nreturn {{ {} }};\n}})();\n", name, body,
                         fmt::join(exported, ", "));
    return done_[name] = true;
  }

  // Returns the script of the modules that were added since the last call.
  JoinedFile take() {
    const std::string head = first_.empty() ? "export const modules = {};\n"
                                            : fmt::format("import {{ modules }} from \"./{}\";\n", first_);
    JoinedFile script = joined_file("js", head + std::exchange(text_, {}));
    if (first_.empty()) first_ = script.name;
    return script;
  }

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
  std::map<std::string, bool, std::less<>> done_;  // true: its text stands in text_ or in a script before
  std::string text_;
  std::string first_;  // name of the first script
};

}  // namespace

std::optional<PageBundle> bundle_page(std::span<const StaticFile> files) {
  Sources sources;
  for (const StaticFile& file : files) sources.emplace(file.name, text_of(file));
  const auto page = sources.find("index.html");
  if (page == sources.end()) return std::nullopt;
  static const std::regex kStyle(R"re(\s*<link rel="stylesheet" href="([^"]+)">\s*)re");
  static const std::regex kScript(R"re(\s*<script type="module"( async)? src="([^"]+)"></script>\s*)re");
  PageBundle bundle;
  std::string style;
  Joined joined(sources);
  bool known = true, styled = false;
  each_line(page->second, [&](std::string_view view) {
    const std::string line(view);
    std::smatch parts;
    if (std::regex_match(line, parts, kStyle)) {
      const auto sheet = sources.find(parts[1].str());
      known = known && sheet != sources.end();
      if (known) style += sheet->second;
      if (!std::exchange(styled, true)) bundle.page += "  <link rel=\"stylesheet\" href=\"{style}\">\n";
    } else if (std::regex_match(line, parts, kScript)) {
      known = known && joined.add(parts[2]);
      bundle.scripts.push_back(joined.take());
      bundle.page += fmt::format("  <script type=\"module\"{} src=\"{}\"></script>\n", parts[1].str(),
                                 bundle.scripts.back().name);
    } else {
      bundle.page += line;
    }
  });
  if (!known || !styled || bundle.scripts.empty()) return std::nullopt;
  bundle.style = joined_file("css", std::move(style));
  constexpr std::string_view kMark = "{style}";
  bundle.page.replace(bundle.page.find(kMark), kMark.size(), bundle.style.name);
  return bundle;
}

}  // namespace ls::http
