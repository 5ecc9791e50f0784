#include "common/trace/span.h"

#include <gtest/gtest.h>

namespace ls::trace {
namespace {

constexpr const char* kText = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";

TEST(Traceparent, ReadsBackAsItWasWritten) {
  const auto context = parse_traceparent(kText);

  ASSERT_TRUE(context);
  EXPECT_EQ(hex(context->trace), "0af7651916cd43dd8448eb211c80319c");
  EXPECT_EQ(hex(context->span), "b7ad6b7169203331");
  EXPECT_TRUE(context->sampled);
  EXPECT_EQ(to_traceparent(*context), kText);
}

TEST(Traceparent, SaysWhetherTheTraceIsRecorded) {
  std::string text = kText;
  text.back() = '2';

  EXPECT_FALSE(parse_traceparent(text)->sampled);
  EXPECT_TRUE(to_traceparent(*parse_traceparent(text)).ends_with("-00"));
}

TEST(Traceparent, OfALaterVersionIsReadAsFarAsItIsKnown) {
  EXPECT_TRUE(parse_traceparent("cc" + std::string(kText).substr(2) + "-what-comes"));
  EXPECT_FALSE(parse_traceparent("cc" + std::string(kText).substr(2) + ".what-comes"));
}

TEST(Traceparent, IsIgnoredIfItIsNone) {
  const std::string good = kText;
  const auto changed = [&](std::size_t at, const std::string& part) {
    std::string text = good;
    return text.replace(at, part.size(), part);
  };
  for (const std::string& text :
       {std::string(), std::string("00"), good.substr(0, 54), good + "0", good + "-00", changed(0, "ff"),
        changed(2, "_"), changed(3, std::string(32, '0')), changed(36, std::string(16, '0')), changed(3, "A"),
        changed(52, "+"), changed(53, "x"), std::string(55, '\0'), std::string(1 << 20, '-')})
    EXPECT_FALSE(parse_traceparent(text)) << text.substr(0, 60);
}

TEST(Ids, AreTheSameForTheSameTextOnly) {
  EXPECT_EQ(trace_id_of("job j-1"), trace_id_of("job j-1"));
  EXPECT_NE(trace_id_of("job j-1"), trace_id_of("job j-2"));
  const TraceId trace = trace_id_of("job j-1");
  EXPECT_EQ(span_id_of(trace, "lease l1-1"), span_id_of(trace, "lease l1-1"));
  EXPECT_NE(span_id_of(trace, "lease l1-1"), span_id_of(trace_id_of("job j-2"), "lease l1-1"));
}

}  // namespace
}  // namespace ls::trace
