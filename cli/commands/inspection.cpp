#include "cli/commands/inspection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "cli/output/console.h"
#include "common/base/safe_text.h"

namespace ls::cli {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

// Bytes per pixel of the coordinator's film: R, G and B sums of the two halves of the samples, in double.
constexpr std::uint64_t kFilmBytesPerPixel = 6 * sizeof(double);

ordered_json files_that_stay(const LocalScene& scene, const JobSpec& spec) {
  ordered_json stay = ordered_json::array();
  for (const auto& [name, file] : scene.files)
    if (!is_needed(scene, spec, file)) stay.push_back({{"name", name}, {"bytes", file.bytes}});
  return stay;
}

std::string times(std::uint64_t count, const std::string& what) {
  return count == 1 ? what : fmt::format("{} x {}", count, what);
}

// Formats a list with a title and aligned columns. The last column is not padded.
class TextTable {
 public:
  explicit TextTable(std::string title) : title_(std::move(title)) {}
  void add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  std::string text() const {
    if (rows_.empty()) return "";
    std::vector<std::size_t> widths;
    for (const auto& row : rows_) {
      widths.resize(std::max(widths.size(), row.size()), 0);
      for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
    }
    std::string out = "\n" + title_ + "\n";
    for (const auto& row : rows_) {
      std::string line = " ";
      for (std::size_t i = 0; i < row.size(); ++i)
        line += " " + (i + 1 < row.size() ? fmt::format("{:<{}}", row[i], widths[i] + 1) : row[i]);
      line.erase(line.find_last_not_of(' ') + 1);
      out += line + "\n";
    }
    return out;
  }

 private:
  std::string title_;
  std::vector<std::vector<std::string>> rows_;
};

std::string text_at(const ordered_json& j, const char* key) {
  return plain_text(j.at(key).get<std::string>());
}
std::uint64_t sum_of_bytes(const ordered_json& list) {
  std::uint64_t sum = 0;
  for (const auto& x : list) sum += x.at("bytes").get<std::uint64_t>();
  return sum;
}

std::string head(const ordered_json& j) {
  const std::string spp = j.at("spp").is_null() ? "as many as it takes" : j.at("spp").dump();
  return fmt::format(
      "{}\n{} x {} pixels, {} samples per pixel, integrator {}\ninstantiated for: {} ({} there are)\n",
      text_at(j, "scene"), j.at("size")[0].get<int>(), j.at("size")[1].get<int>(), spp,
      text_at(j, "integrator"), text_at(j, "variant"), j.at("variants").get<int>());
}

std::string parts(const ordered_json& j, bool used) {
  TextTable table(used ? "uses, and the bytes of files that it reads" : "leaves out: no bytes");
  for (const auto& part : j.at("parts"))
    if (part.at("used") == used) {
      const std::uint64_t bytes = part.at("bytes");
      std::vector<std::string> row{text_at(part, "part"), text_at(part, "why")};
      if (used) row.insert(row.begin() + 1, bytes > 0 ? show_bytes(bytes) : "-");
      table.add(std::move(row));
    }
  return table.text();
}

// Lists the renderer's optional features that the scene uses and those that it does not use, such as grids, a
// light tree or equi-angular sampling. They are known only after the scene's files have been loaded.
std::string made_ready(const ordered_json& j) {
  const auto listed = [&](const char* key) {
    std::vector<std::string> all;
    for (const auto& x : j.at(key)) all.push_back(plain_text(x.get<std::string>()));
    return all.empty() ? std::string("nothing") : fmt::format("{}", fmt::join(all, "; "));
  };
  return fmt::format("\nmade ready to trace, it has: {}\nand does without: {}\n", listed("features_used"),
                     listed("features_left_out"));
}

std::string technique_table(const ordered_json& j) {
  TextTable table("techniques at work, and what switches each off in the scene's integrator");
  for (const auto& t : j.at("techniques"))
    table.add({text_at(t, "name"),
               fmt::format("{}=\"{}\"", text_at(t.at("off"), "parameter"), text_at(t.at("off"), "value")),
               text_at(t, "what")});
  return table.text();
}

std::string pruned(const ordered_json& j) {
  TextTable table("taken out of the scene, as no pixel depends on it");
  for (const auto& x : j.at("pruned")) {
    const std::uint64_t bytes = x.at("bytes");
    table.add(
        {times(x.at("count"), text_at(x, "what")), bytes > 0 ? show_bytes(bytes) : "", text_at(x, "why")});
  }
  return table.text();
}

std::string files(const ordered_json& j) {
  const auto& travel = j.at("assets");
  const auto& stay = j.at("files_left_out");
  TextTable going(fmt::format("goes to workers: {} in {} files, and {} of scene",
                              show_bytes(sum_of_bytes(travel)), travel.size(),
                              show_bytes(j.at("scene_bytes"))));
  for (const auto& file : travel)
    going.add({text_at(file, "name"), show_bytes(file.at("bytes")), text_at(file, "uses")});
  TextTable staying(fmt::format("stays here: {} in {} files that nothing needed names",
                                show_bytes(sum_of_bytes(stay)), stay.size()));
  for (const auto& file : stay) staying.add({text_at(file, "name"), show_bytes(file.at("bytes"))});
  const std::string none =
      fmt::format("\ngoes to workers: {} of scene, no files\n", show_bytes(j.at("scene_bytes")));
  return (travel.empty() ? none : going.text()) + staying.text();
}

// Draws a bar of up to 24 marks; the bar for `largest` has all 24.
std::string bar(std::uint64_t bytes, std::uint64_t largest) {
  if (bytes == 0 || largest == 0) return "";
  const auto marks =
      static_cast<std::size_t>(24. * static_cast<double>(bytes) / static_cast<double>(largest) + .5);
  return std::string(std::max<std::size_t>(1, marks), '#');
}

std::string memory(const ordered_json& j) {
  const auto& all = j.at("structures");
  std::uint64_t largest = 0;
  for (const auto& s : all) largest = std::max(largest, s.at("bytes").get<std::uint64_t>());
  TextTable table(fmt::format("in a worker's memory: {}", show_bytes(sum_of_bytes(all))));
  for (const auto& s : all) {
    const std::uint64_t bytes = s.at("bytes");
    table.add(
        {text_at(s, "name"), bytes > 0 ? show_bytes(bytes) : "-", bar(bytes, largest), text_at(s, "detail")});
  }
  return table.text() + fmt::format("in the coordinator's: {} of film\n", show_bytes(j.at("film_bytes")));
}

// Describes a variant's instructions per path, and by how many percent they exceed those of the cheapest
// variant. Either argument is null if the instructions could not be counted.
std::string instructions(const ordered_json& per_path, const ordered_json& cheapest) {
  if (per_path.is_null()) return "";
  const double n = per_path;
  const std::string more = cheapest.is_null() || cheapest == per_path
                               ? ""
                               : fmt::format(", {:+.1f} %", 100 * (n / cheapest.get<double>() - 1));
  return fmt::format("{:.0f} instructions a path{}", n, more);
}

std::string variants(const ordered_json& j) {
  const auto& rendered = j.find("variant_bits");
  if (rendered == j.end()) return "";
  TextTable table("every instantiation that covers the scene, on a small image");
  const auto& first = rendered->front().at("instructions_per_path");
  for (const auto& v : *rendered)
    table.add({text_at(v, "variant"), text_at(v, "sums_sha256"),
               instructions(v.at("instructions_per_path"), first)});
  const std::string uncounted =
      j.contains("uncounted") ? fmt::format("instructions are not counted: {}\n", text_at(j, "uncounted"))
                              : "";
  return table.text() + (j.at("variants_agree") ? "the same bits\n" : "DIFFERENT BITS: this is a bug\n") +
         uncounted;
}

}  // namespace

ordered_json inspection(const LocalScene& scene, const LocalWorld& built, const VariantBitsList& rendered) {
  const coordinator::StoredJob& job = built.job;
  const render::WorldReport world = render::describe(*built.world);
  const auto size = job.settings.size;
  const json analysis = json::parse(job.analysis);
  ordered_json j{{"scene", scene.name},
                 {"scene_sha256", job.scene.hex()},
                 {"size", {size.width, size.height}},
                 {"spp", job.spp ? ordered_json(*job.spp) : ordered_json()},
                 {"integrator", job.settings.integrator},
                 {"max_depth", job.settings.max_depth},
                 {"variant", world.variant},
                 {"variants", world.variants},
                 {"features_used", world.used},
                 {"features_left_out", world.left_out},
                 {"techniques", ordered_json::parse(techniques_json(render::techniques_of(*built.world),
                                                                    job.settings.integrator))},
                 {"needs", ordered_json::parse(job.needs)},
                 {"parts", analysis.at("parts")},
                 {"pruned", analysis.at("left_out")},
                 {"scene_bytes", built.scene_bytes},
                 {"assets", ordered_json::array()},
                 {"files_left_out", files_that_stay(scene, job.spec)},
                 {"structures", ordered_json::array()},
                 {"film_bytes", kFilmBytesPerPixel * static_cast<std::uint64_t>(size.width) *
                                    static_cast<std::uint64_t>(size.height)},
                 {"clamped_inputs", world.clamped_inputs},
                 {"warnings", job.warnings}};
  for (const scene::FileNeed& file : built.needs.files)
    j["assets"].push_back({{"name", file.name},
                           {"bytes", file.bytes},
                           {"sha256", file.digest.hex()},
                           {"uses", fmt::format("{}", fmt::join(file.uses, ", "))}});
  for (const auto& s : world.structures)
    j["structures"].push_back({{"name", s.name}, {"bytes", s.bytes}, {"detail", s.detail}});
  if (rendered.all.empty()) return j;
  j["variant_bits"] = ordered_json::array();
  bool same = true;
  for (const VariantBits& v : rendered.all) {
    j["variant_bits"].push_back(
        {{"variant", v.name},
         {"sums_sha256", v.sums.hex()},
         {"instructions_per_path", v.instructions ? ordered_json(*v.instructions) : ordered_json()}});
    same = same && v.sums == rendered.all.front().sums;
  }
  j["variants_agree"] = same;
  if (!rendered.uncounted.empty()) j["uncounted"] = rendered.uncounted;
  return j;
}

std::string inspection_text(const ordered_json& j) {
  std::string out = head(j) + parts(j, true) + parts(j, false) + made_ready(j) + technique_table(j) +
                    pruned(j) + files(j) + memory(j) + variants(j);
  if (const auto work = j.find("work"); work != j.end()) {
    TextTable table("work of a small image");
    for (const auto& [name, count] : work->items()) table.add({name, count.dump()});
    out += table.text();
  }
  if (const std::uint64_t clamped = j.at("clamped_inputs"); clamped > 0)
    out += fmt::format("\n{} inputs were clamped (negative densities and texels, degenerate triangles)\n",
                       clamped);
  return out;
}

}  // namespace ls::cli
