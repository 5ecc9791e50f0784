// The numeric class must tell machines apart whose libraries differ in one last place (libraries.h). The
// class is computed once a process, so every answer comes from a child. `nm` of the renderer's libraries
// lists the functions that it calls.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <set>
#include <string>
#include <vector>

#include "core/assets/image.h"
#include "core/job/settings.h"
#include "tests/unit/numeric_class/libraries.h"
#include "worker/render/numeric_class/battery_images.h"
#include "worker/render/render.h"

namespace ls::render {
namespace {

// The class of a machine on which this function is off by one unit in its last place.
std::string class_of_machine(const char* perturbed) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  const pid_t child = fork();
  if (child == 0) {
    test::g_perturbed = perturbed;
    const std::string hex = numeric_class().hex();
    const bool written = write(ends[1], hex.data(), hex.size()) == static_cast<ssize_t>(hex.size());
    _exit(written ? 0 : 1);
  }
  close(ends[1]);
  std::string hex(64, ' ');
  const bool complete = read(ends[0], hex.data(), hex.size()) == static_cast<ssize_t>(hex.size());
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return complete && status == 0 ? hex : "the child died";
}

TEST(NumericClass, DiffersWhereAnyFunctionThatTheRendererCallsDoes) {
  const std::string here = class_of_machine("");
  ASSERT_EQ(here.size(), 64u) << here;
  ASSERT_EQ(class_of_machine(""), here);
  for (const char* name :
       {"acosf",         "erff", "expf",  "expm1f", "log1pf", "logf",    "tanf",
        "acos",          "cos",  "erfc",  "exp",    "log",    "sin",     "tan",
        "atan2f",        "powf", "atan2", "hypot",  "pow",    "sincosf", "Embree's version",
        "rtcIntersect1", "JPEG", "DWA",   "B44",    "PXR24"}) {
    const std::string there = class_of_machine(name);
    EXPECT_EQ(there.size(), 64u) << name << ": " << there;
    EXPECT_NE(there, here) << name;
  }
}

TEST(NumericClass, HasAPlatformThatAJobCanRequest) {
  const std::string asked = R"({"numeric_class": ")" + platform() + "\"}";

  const auto spec = parse_job_spec(asked);

  ASSERT_TRUE(spec) << spec.error().message;
  EXPECT_EQ(spec->numeric_class, platform());
  EXPECT_NE(platform().find(":embree-"), std::string::npos) << platform();
}

TEST(NumericClass, TestImagesAreReadableAndVaried) {
  for (const std::string_view picture : {battery::kJpeg, battery::kDwa, battery::kB44, battery::kPxr24}) {
    std::vector<std::byte> bytes;
    for (std::size_t i = 0; i < picture.size(); i += 2)
      bytes.push_back(std::byte(std::stoi(std::string(picture.substr(i, 2)), nullptr, 16)));

    const auto image = decode_image("battery", bytes);

    ASSERT_TRUE(image) << image.error().message;
    EXPECT_EQ(image->channels, 3u);
    std::set<float> values(image->u8.begin(), image->u8.end());
    values.insert(image->f32.begin(), image->f32.end());
    EXPECT_GT(values.size(), 64u);  // of 3 x 64 and more
  }
}

}  // namespace
}  // namespace ls::render
