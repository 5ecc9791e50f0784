#include "cli/farm/fetch_results.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "cli/farm/http_client.h"
#include "cli/output/console.h"
#include "cli/output/output_file.h"
#include "cli/output/reply_fields.h"

namespace ls::cli {
namespace {

using nlohmann::json;

struct Download {
  std::string path, option, file;
};

// Returns the frame number in a farm's answer. Only small non-negative integers are accepted: answers are
// untrusted, and the number becomes part of file names.
std::optional<std::uint32_t> frame_number(const json& frame) {
  const int number = frame.is_object() ? int_field(frame, "frame", -1) : -1;
  if (number < 0 || number > static_cast<int>(kMaxFrameNumber)) return std::nullopt;
  return static_cast<std::uint32_t>(number);
}

struct Plan {
  std::vector<Download> downloads;
  std::vector<std::uint32_t> empty;  // frames that have no results
};

// Returns the path and parameters of the image within `job`. The PNG of a denoised job is the denoised image.
std::string image_of(const json& job, const Results& wanted) {
  if (image_format(wanted.image) != ImageFormat::png) return "/image.exr";
  return flag_field(job, "denoise") ? "/image.png?layer=denoised" : "/image.png";
}

Result<Plan> plan_sequence(const std::string& id, const json& job, const Results& wanted) {
  const json& frames = job["frames"];
  const auto list = frames.find("list");
  if (list == frames.end() || !list->is_array())
    return fail(Errc::internal, "the coordinator does not say which frames the job has");
  for (const auto& [option, name] : {std::pair("-o", wanted.image), std::pair("--html", wanted.html)})
    if (!name.empty() && !has_frame_number(name) && list->size() != 1)
      return fail(
          Errc::invalid_argument,
          fmt::format("{} {}: job {} has {} frames: give a name with # for their numbers, out_#### say, "
                      "or choose one by --frame N",
                      option, name, id, list->size()));
  Plan plan;
  const bool reports = has_frame_number(wanted.report);
  for (const json& frame : *list) {
    const auto number = frame_number(frame);
    if (!number) return fail(Errc::internal, "the coordinator names a frame that can't be one");
    if (!(number_field(frame, "spp_done").value_or(0) > 0)) {
      plan.empty.push_back(*number);
      continue;
    }
    const auto add = [&](const char* option, const std::string& name, const std::string& what) {
      const char join = what.find('?') == std::string::npos ? '?' : '&';
      plan.downloads.push_back({fmt::format("{}{}{}frame={}", job_path(id), what, join, *number), option,
                                numbered(name, *number)});
    };
    if (!wanted.image.empty()) add("-o", wanted.image, image_of(job, wanted));
    if (reports) add("--report", wanted.report, "/report");
    if (!wanted.html.empty()) add("--html", wanted.html, "/report.html");
  }
  if (!wanted.report.empty() && !reports)
    plan.downloads.push_back({job_path(id) + "/report", "--report", wanted.report});
  return plan;
}

Plan plan_image(const std::string& id, const json& job, const Results& wanted) {
  Plan plan;
  if (!wanted.image.empty())
    plan.downloads.push_back({job_path(id) + image_of(job, wanted), "-o", wanted.image});
  if (!wanted.report.empty()) plan.downloads.push_back({job_path(id) + "/report", "--report", wanted.report});
  if (!wanted.html.empty()) plan.downloads.push_back({job_path(id) + "/report.html", "--html", wanted.html});
  return plan;
}

}  // namespace

Result<void> check_outputs(const std::string& option, const std::string& name,
                           const std::optional<FrameRange>& frames) {
  if (option == "-o")
    if (const auto format = image_format(name); !format) return tl::unexpected(format.error());
  if (!frames) return check_output(option, name);
  if (option != "--report")
    if (auto ok = check_numbered(option, name, *frames); !ok) return ok;
  for (const std::uint32_t frame : frames->frames()) {
    if (auto ok = check_output(option, numbered(name, frame)); !ok) return ok;
    if (!has_frame_number(name)) break;
  }
  return {};
}

int fetch_results(FarmApi& api, const std::string& id, const Results& wanted) {
  if (wanted.image.empty() && wanted.report.empty() && wanted.html.empty()) return kOk;
  if (const auto format = image_format(wanted.image); !format) return print_error(format.error());
  const auto call = [&](auto request) { return wanted.patient ? with_retries(request) : request(); };
  const auto job = call([&] { return api.get(job_path(id)); });
  if (!job) return print_rejected(job.error());
  const auto frames = job->find("frames");
  const auto plan = frames != job->end() && frames->is_object() ? plan_sequence(id, *job, wanted)
                                                                : Result<Plan>(plan_image(id, *job, wanted));
  if (!plan) return print_error(plan.error());
  for (const Download& d : plan->downloads) {
    if (const auto ok = check_output(d.option, d.file); !ok) return print_error(ok.error());
    if (const auto got = call([&] { return api.download(d.path, d.file); }); !got)
      return print_rejected(got.error());
    if (wanted.json) print(json{{"file", d.file}}.dump(-1, ' ', false, json::error_handler_t::replace));
  }
  if (plan->empty.empty()) return kOk;
  constexpr std::size_t kShown = 20;
  const std::size_t shown = std::min(plan->empty.size(), kShown);
  complain(fmt::format(
      "nothing has come yet of {} of the frames: {}{}", plan->empty.size(),
      fmt::join(plan->empty.begin(), plan->empty.begin() + static_cast<std::ptrdiff_t>(shown), ", "),
      shown < plan->empty.size() ? ", ..." : ""));
  return kFailed;
}

}  // namespace ls::cli
