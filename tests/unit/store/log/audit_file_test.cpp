#include "coordinator/store/log/audit_file.h"

#include <gtest/gtest.h>

#include "tests/unit/store/temp_folder.h"

namespace ls::coordinator {
namespace {

const std::vector<JobRestored::Audit> kSome{{7, 3, std::nullopt}, {8, 0, {{{"w-1f"}, sha256("pixels")}}}};

TEST(AuditFile, ReadsBackWhatItWrote) {
  TempFolder dir;
  EXPECT_TRUE(read_audits(dir.path()).empty());

  ASSERT_TRUE(write_audits(dir.path(), audits_text(kSome)));
  EXPECT_EQ(read_audits(dir.path()), kSome);

  ASSERT_TRUE(write_audits(dir.path(), ""));
  EXPECT_TRUE(read_audits(dir.path()).empty());
}

TEST(AuditFile, SkipsMalformedLines) {
  const std::string good = audits_text(kSome);
  for (const char* bad : {"", "7", "x 3", "7 3 w-1f", "7 3 w-1f 12", "-1 -1 -1", "7 3 w-1f zz more"})
    EXPECT_EQ(parse_audits(std::string(bad) + "\n" + good), kSome) << bad;
  for (std::size_t n = 0; n < good.size(); ++n) EXPECT_LE(parse_audits(good.substr(0, n)).size(), 2u) << n;
}

}  // namespace
}  // namespace ls::coordinator
