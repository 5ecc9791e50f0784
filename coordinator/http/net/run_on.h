// Runs blocking work on a thread pool. The coroutine that awaits run_on() resumes on the network thread with
// the result.
#pragma once

#include <boost/asio/async_result.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <type_traits>
#include <utility>

namespace ls::http {

// `work` must not throw and must return a movable value. A work guard must keep `io` running until `work` has
// returned.
template <class Work>
boost::asio::awaitable<std::invoke_result_t<Work&>> run_on(boost::asio::thread_pool& pool,
                                                           boost::asio::io_context& io, Work work) {
  namespace net = boost::asio;
  using Value = std::invoke_result_t<Work&>;
  auto initiate = [&pool, &io, work = std::move(work)](auto handler) mutable {
    net::post(pool, [&io, work = std::move(work), handler = std::move(handler)]() mutable {
      Value value = work();
      net::post(io, [value = std::move(value), handler = std::move(handler)]() mutable {
        std::move(handler)(std::move(value));
      });
    });
  };
  co_return co_await net::async_initiate<const net::use_awaitable_t<>, void(Value)>(std::move(initiate),
                                                                                    net::use_awaitable);
}

}  // namespace ls::http
