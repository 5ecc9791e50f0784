// A user's submission, and the answer if it is rejected.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/job/settings.h"
#include "common/scene/diagnostic.h"

namespace ls::coordinator {

struct SubmitRequest {
  std::string scene_name;  // name of the main file, for diagnostics
  std::string scene_text;  // Mitsuba or Nori XML
  // The files that the scene may name; their blobs must be in the store
  std::map<std::string, Digest> assets;
  JobSpec spec;
  std::string owner = {};  // the user who submits it: JobView::owner
};
struct Rejected {
  Error error;
  std::vector<Diagnostic> diagnostics;
};

}  // namespace ls::coordinator
