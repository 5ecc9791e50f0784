#include "util/trace/otel_settings.h"

#include <gtest/gtest.h>

#include <map>

namespace ls::trace {
namespace {

using Variables = std::map<std::string, std::string>;

Result<std::optional<Settings>> read(const Variables& variables) {
  return settings_from(
      [&](const char* name) {
        const auto found = variables.find(name);
        return found == variables.end() ? nullptr : found->second.c_str();
      },
      "lightshaft-worker");
}

const std::string kEndpoint = "OTEL_EXPORTER_OTLP_ENDPOINT";

TEST(TraceSettings, NothingIsTracedWithoutAnEndpointOrIfThatIsSwitchedOff) {
  EXPECT_EQ(read({}).value(), std::nullopt);
  EXPECT_EQ(read({{kEndpoint, ""}, {"OTEL_SERVICE_NAME", "x"}}).value(), std::nullopt);
  EXPECT_EQ(read({{kEndpoint, "http://c:4318"}, {"OTEL_SDK_DISABLED", "true"}}).value(), std::nullopt);
  EXPECT_EQ(read({{kEndpoint, "http://c:4318"}, {"OTEL_SDK_DISABLED", "True"}}).value(), std::nullopt);
  for (const char* other : {"false", "", "truer", "tru"})
    EXPECT_NE(read({{kEndpoint, "http://c:4318"}, {"OTEL_SDK_DISABLED", other}}).value(), std::nullopt);
  EXPECT_EQ(read({{kEndpoint, "http://c:4318"}, {"OTEL_TRACES_EXPORTER", "none"}}).value(), std::nullopt);
}

TEST(TraceSettings, EndpointForAllSignalsGetsTheTracesPathAndTheTracesEndpointIsUsedUnchanged) {
  EXPECT_EQ(read({{kEndpoint, "http://c:4318"}}).value()->url, "http://c:4318/v1/traces");
  EXPECT_EQ(read({{kEndpoint, "http://c:4318/otlp/"}}).value()->url, "http://c:4318/otlp/v1/traces");
  EXPECT_EQ(
      read({{kEndpoint, "http://c"}, {"OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "https://d/in"}}).value()->url,
      "https://d/in");
}

TEST(TraceSettings, HeadersAndAttributesAreDecoded) {
  const auto settings =
      read({{kEndpoint, "http://c"},
            {"OTEL_EXPORTER_OTLP_HEADERS", "a=1"},
            {"OTEL_EXPORTER_OTLP_TRACES_HEADERS", "authorization=Basic%20eA==, x-scope = 7 ,"},
            {"OTEL_RESOURCE_ATTRIBUTES", "deployment.environment=lab"},
            {"OTEL_EXPORTER_OTLP_TIMEOUT", "2500"},
            {"OTEL_EXPORTER_OTLP_CERTIFICATE", "/ca.pem"},
            {"OTEL_SERVICE_NAME", "farm"}})
          .value()
          .value();
  using Pairs = std::vector<std::pair<std::string, std::string>>;
  EXPECT_EQ(settings.headers, (Pairs{{"authorization", "Basic eA=="}, {"x-scope", "7"}}));
  EXPECT_EQ(settings.resource, (Pairs{{"deployment.environment", "lab"}}));
  EXPECT_EQ(settings.seconds, 2.5);
  EXPECT_EQ(settings.ca_file, "/ca.pem");
  EXPECT_EQ(settings.service, "farm");
  EXPECT_EQ(read({{kEndpoint, "http://c"}}).value()->service, "lightshaft-worker");
}

TEST(TraceSettings, ServiceHasOneNameAndItsOwnVariableTakesPrecedence) {
  Variables variables{{kEndpoint, "http://c"}, {"OTEL_RESOURCE_ATTRIBUTES", "a=b,service.name=farm"}};
  const auto by_attribute = read(variables).value().value();
  variables["OTEL_SERVICE_NAME"] = "own";
  const auto by_variable = read(variables).value().value();

  EXPECT_EQ(by_attribute.service, "farm");
  EXPECT_EQ(by_variable.service, "own");
  for (const auto& settings : {by_attribute, by_variable}) {
    ASSERT_EQ(settings.resource.size(), 1u);
    EXPECT_EQ(settings.resource[0].first, "a");
  }
}

TEST(TraceSettings, AcceptsProtocolsOfTheSamePort) {
  for (const char* protocol : {"", "http/json", "http/protobuf"})
    EXPECT_TRUE(read({{kEndpoint, "http://c"}, {"OTEL_EXPORTER_OTLP_PROTOCOL", protocol}}).value())
        << protocol;
}

TEST(TraceSettings, InvalidVariableIsNamed) {
  for (const auto& [name, value] : Variables{{"OTEL_EXPORTER_OTLP_TRACES_ENDPOINT", "c:4318"},
                                             {"OTEL_EXPORTER_OTLP_HEADERS", "no pair"},
                                             {"OTEL_EXPORTER_OTLP_TRACES_HEADERS", "a=%zz"},
                                             {"OTEL_RESOURCE_ATTRIBUTES", "a=b%0d%0aevil: 1"},
                                             {"OTEL_EXPORTER_OTLP_TIMEOUT", "0"},
                                             {"OTEL_EXPORTER_OTLP_PROTOCOL", "grpc"},
                                             {"OTEL_EXPORTER_OTLP_TRACES_PROTOCOL", "http/jason"},
                                             {"OTEL_TRACES_EXPORTER", "zipkin"},
                                             {"OTEL_TRACES_SAMPLER", "jaeger_remote"}}) {
    const auto settings = read({{kEndpoint, "http://c"}, {name, value}});
    ASSERT_FALSE(settings) << name;
    EXPECT_EQ(settings.error().code, Errc::invalid_argument);
    EXPECT_NE(settings.error().message.find(name), std::string::npos) << settings.error().message;
  }
  const auto ratio = read(
      {{kEndpoint, "http://c"}, {"OTEL_TRACES_SAMPLER", "traceidratio"}, {"OTEL_TRACES_SAMPLER_ARG", "2"}});
  EXPECT_NE(ratio.error().message.find("OTEL_TRACES_SAMPLER_ARG"), std::string::npos);
}

TEST(TraceSettings, MessagesDoNotRepeatHeaderValues) {
  const auto settings = read({{kEndpoint, "http://c"}, {"OTEL_EXPORTER_OTLP_HEADERS", "key=s3cret%"}});
  EXPECT_EQ(settings.error().message.find("s3cret"), std::string::npos);
}

Sampler sampler(const std::string& name, const std::string& argument = "") {
  return read({{kEndpoint, "http://c"}, {"OTEL_TRACES_SAMPLER", name}, {"OTEL_TRACES_SAMPLER_ARG", argument}})
      .value()
      ->sampler;
}

TEST(Sampler, FollowsTheParentsDecisionUnlessConfiguredOtherwise) {
  const TraceId id = trace_id_of("x");
  EXPECT_TRUE(sampler("").takes(id, std::nullopt));
  EXPECT_FALSE(sampler("").takes(id, false));
  EXPECT_TRUE(sampler("parentbased_always_off").takes(id, true));
  EXPECT_FALSE(sampler("parentbased_always_off").takes(id, std::nullopt));
  EXPECT_TRUE(sampler("always_on").takes(id, false));
  EXPECT_FALSE(sampler("always_off").takes(id, true));
}

// The decision depends on the trace id, which is a digest. So the number of sampled traces of 10,000 is
// binomial with p = 1/4 and has the standard deviation 43.3. It exceeds 5 deviations with a probability of
// one in a million. The ids are fixed, and so is the count.
TEST(Sampler, SamplesItsFractionOfTraces) {
  const Sampler quarter = sampler("traceidratio", "0.25");
  int taken = 0;
  for (int i = 0; i < 10'000; ++i) taken += quarter.takes(trace_id_of(std::to_string(i)), std::nullopt);
  EXPECT_NEAR(taken, 2500, 5 * 43.3);
  EXPECT_FALSE(sampler("traceidratio", "0").takes(trace_id_of("x"), std::nullopt));
  EXPECT_TRUE(
      sampler("traceidratio", "1")
          .takes(TraceId{{255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255, 255}},
                 std::nullopt));
}

}  // namespace
}  // namespace ls::trace
