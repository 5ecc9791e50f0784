#include "cli/output/meter_table.h"

#include <fmt/format.h>

#include <vector>

#include "cli/output/console.h"
#include "cli/output/reply_fields.h"
#include "core/base/safe_text.h"

namespace ls::cli {
namespace {

using nlohmann::json;

constexpr std::size_t kShown = 40;

std::string number(double value) { return fmt::format("{:.5g}", value); }

std::string doubt_about(const json& meter) {
  if (!pair_field(meter, "luminance_ci95")) return "no sample has found light";
  return flag_field(meter, "trusted") ? "" : "don't trust yet: few samples carry it";
}

std::vector<std::string> row_of(const json& meter) {
  std::vector<std::string> row{plain_text(text_field(meter, "name"))};
  for (const json& channel : list_field(meter, "value"))
    row.push_back(channel.is_number() ? number(channel.get<double>()) : "-");
  row.resize(4);
  const auto value = number_field(meter, "luminance");
  const auto ci = pair_field(meter, "luminance_ci95");
  row.push_back(value ? number(*value) : "-");
  row.push_back(ci ? fmt::format("+- {:.2g}", (ci->second - ci->first) / 2) : "");
  row.push_back(plain_text(text_field(meter, "unit")));
  row.push_back(doubt_about(meter));
  return row;
}

}  // namespace

std::string meter_table(const json& meters) {
  if (!meters.is_array() || meters.empty()) return "";
  std::vector<std::vector<std::string>> rows{{"meter", "R", "G", "B", "luminance", "95 %", "unit", ""}};
  for (std::size_t i = 0; i < meters.size() && i < kShown; ++i)
    if (meters[i].is_object()) rows.push_back(row_of(meters[i]));
  std::string table = aligned(rows);
  if (meters.size() > kShown) table += fmt::format("\nand {} more", meters.size() - kShown);
  return table;
}

}  // namespace ls::cli
