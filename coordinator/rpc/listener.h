// Listens on the workers' port, and passes the connections that it admits (ConnectionTable) to the gRPC
// server. gRPC's own listener is not used: after one "too many open files" gRPC 1.51 never accepts a
// connection again (docs/decisions/0043-connections-of-workers.md).
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "coordinator/rpc/connection_table.h"
#include "core/base/clock.h"
#include "core/base/error.h"

namespace ls::coordinator::rpc {

// Returns how many connections fit where this process may have `files` files open. Each takes two: gRPC's,
// and a second one with which the Listener closes the connection. The rest stays for the HTTP interface, the
// store and the files of jobs.
std::size_t connections_for(std::uint64_t files);

class Listener {
 private:
  struct State;

 public:
  // Takes a connected socket, which does not block, and owns it from then on
  using TakeSocket = std::function<void(int socket)>;

  // Listens on `address`, "HOST:PORT"; port 0: any. All addresses of the host's name are listened on, and
  // 0.0.0.0 also takes connections of IPv6. Nothing is accepted before start(). unavailable: the port is
  // taken or the address is not this machine's; invalid_argument: it is no address.
  static Result<std::unique_ptr<Listener>> open(const std::string& address, ConnectionTable::Limits limits);
  ~Listener();  // calls stop()

  int port() const;
  // Starts the thread that accepts connections and calls `take` for each.
  void start(TakeSocket take);
  // Closes the port. Connections that were passed on stay open.
  void stop();

  // A call of a worker, on a connection that this Listener accepted; it is counted until it is destroyed.
  class Call {
   public:
    Call(std::shared_ptr<State> state, ConnectionTable::Guest guest)
        : state_(std::move(state)), guest_(std::move(guest)) {}
    ~Call();
    Call(const Call&) = delete;
    Call& operator=(const Call&) = delete;
    // The call has shown the join token.
    void met();
    // The connection and the address of the call
    const ConnectionTable::Guest& guest() const { return guest_; }

   private:
    const std::shared_ptr<State> state_;
    const ConnectionTable::Guest guest_;
    bool met_ = false;
  };
  // Counts a call from this gRPC peer. Null if it has to be refused: its connection has too many calls that
  // have shown no token yet.
  std::unique_ptr<Call> call(std::string_view grpc_peer);

  // Connects to the port as a worker would, and returns true if the server at its other end answers or closes
  // within `time_limit`. nullopt: that cannot be tried, since no file can be opened.
  std::optional<bool> answers(std::chrono::milliseconds time_limit) const;

 private:
  explicit Listener(std::shared_ptr<State> state);
  const std::shared_ptr<State> state_;
};

}  // namespace ls::coordinator::rpc
