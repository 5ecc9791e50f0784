// Which numeric class a job is pinned to, where its pixels are to be checked.
#include "tests/unit/domain/rig.h"

namespace ls::coordinator {
namespace {

Farm::Options audited(double rate) {
  return {.lease_prefix = "t", .limits = {}, .audit_rate = rate, .audit_seed = 7};
}

TEST(Pin, AWorkerThatIsAloneOfItsClassPinsNoJobThatOthersCanCheck) {
  Rig rig(audited(.01));
  rig.join("x", 1, 9);
  for (const char* name : {"a", "b", "c"}) rig.join(name, 1, 1);

  rig.submit(plan_of("j", 40, 2));

  EXPECT_EQ(rig.job().numeric_class, digest_number(1));
  EXPECT_TRUE(rig.held[{"x"}].empty());
  EXPECT_FALSE(rig.farm.may_pin({"j2"}, {"x"}));
  EXPECT_EQ(rig.farm.audit(), "");
}

TEST(Pin, AWorkerThatIsAloneRendersWhereNoOtherClassHasTwoAndTheEndSaysSo) {
  Rig rig(audited(1));
  rig.join("x", 1, 9);
  rig.join("a", 1, 1);
  rig.submit(plan_of("j", 4, 2));
  EXPECT_EQ(rig.job().numeric_class, digest_number(9));

  const auto effects = rig.render_all();

  ASSERT_EQ(of<JobFinished>(effects).size(), 1u);
  EXPECT_EQ(of<JobFinished>(effects)[0].unaudited, 4u);
  EXPECT_EQ(rig.farm.audits().missed, 4u);
}

TEST(Pin, WhereNothingIsAuditedTheFirstWorkerPins) {
  Rig rig(audited(0));
  rig.join("x", 1, 9);
  for (const char* name : {"a", "b"}) rig.join(name, 1, 1);

  rig.submit(plan_of("j", 40, 2));

  EXPECT_EQ(rig.job().numeric_class, digest_number(9));
}

}  // namespace
}  // namespace ls::coordinator
