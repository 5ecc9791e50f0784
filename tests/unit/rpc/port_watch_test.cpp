// Whether the workers' port answers.
#include "coordinator/rpc/port_watch.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <unistd.h>

#include "coordinator/rpc/rpc_server.h"

namespace ls::coordinator::rpc {
namespace {

using namespace std::chrono_literals;

sockaddr_in loopback(int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  return address;
}

std::optional<bool> answers(const sockaddr_in& address, std::chrono::milliseconds time_limit) {
  return port_answers(reinterpret_cast<const sockaddr*>(&address), sizeof address, time_limit);
}

TEST(PortWatch, RunningServerResponds) {
  const auto coordinator = Coordinator::open({}).value();
  GrpcServer server(*coordinator);

  const int port = server.start("127.0.0.1:0").value();

  EXPECT_EQ(answers(loopback(port), 60s), true);
  EXPECT_EQ(server.trouble(), "");
}

// The system itself takes connections for a program that never accepts them.
TEST(PortWatch, ListenerThatAcceptsNothingCountsAsSilent) {
  const int listener = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = loopback(0);
  socklen_t length = sizeof address;
  ASSERT_EQ(::bind(listener, reinterpret_cast<sockaddr*>(&address), length), 0);
  ASSERT_EQ(::listen(listener, 1), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &length), 0);

  EXPECT_EQ(answers(address, 50ms), false);

  ::close(listener);
  EXPECT_EQ(answers(address, 50ms), false) << "nobody listens";
}

TEST(PortWatch, ReportsSilenceAndGivesUpAfterTwoMinutes) {
  PortWatch watch;
  watch.looked(false);
  EXPECT_EQ(watch.trouble(), "") << "one look may fail on a busy machine";
  watch.looked(false);
  EXPECT_NE(watch.trouble().find("has not answered for 20 s"), std::string::npos) << watch.trouble();
  watch.looked(std::nullopt);
  EXPECT_NE(watch.trouble(), "") << "nothing new is known";
  watch.looked(true);
  EXPECT_EQ(watch.trouble(), "");

  for (int i = 0; i < 11; ++i) watch.looked(false);
  EXPECT_FALSE(watch.dead());
  watch.looked(false);

  EXPECT_TRUE(watch.dead());
}

}  // namespace
}  // namespace ls::coordinator::rpc
