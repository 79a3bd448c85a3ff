// SPDX-License-Identifier: Apache-2.0
// Threads that convert large messages from and to JSON, so that they do not delay other connections.

#ifndef DLCS_SERVER_GATEWAY_TRANSLATORS_H_
#define DLCS_SERVER_GATEWAY_TRANSLATORS_H_

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <stop_token>
#include <string>

#include "absl/status/statusor.h"
#include "boost/asio/any_io_executor.hpp"
#include "boost/asio/awaitable.hpp"
#include "boost/asio/thread_pool.hpp"

namespace dlcs {

// A mutex that threads get in the order in which they asked for it.
class TicketLock {
 public:
  void Lock();
  void Unlock();

 private:
  std::mutex mutex_;
  std::condition_variable unlocked_;
  std::uint64_t next_ = 0;     // ticket of the next caller of Lock()
  std::uint64_t current_ = 0;  // ticket of the holder
};

// All conversions together use one processor: they take turns, piece by piece. Small ones have threads of their own, so
// that they wait for a few pieces of large ones and never for the end of one. The largest have one thread, which bounds
// the memory: a message may be several times as large as its JSON. Safe from any thread.
class TranscoderPool {
 public:
  // `is_wanted` is to be called between pieces of some milliseconds; if it returns false, nobody waits for the result.
  using Work = std::function<absl::StatusOr<std::string>(const std::function<bool()>& is_wanted)>;

  // Runs `work`, for a message of so many bytes, until `disconnected` is requested; the coroutine resumes on
  // `executor`.
  boost::asio::awaitable<absl::StatusOr<std::string>> Run(std::size_t bytes, std::stop_token disconnected,
                                                          boost::asio::any_io_executor executor, Work work);

 private:
  boost::asio::thread_pool& ThreadsFor(std::size_t bytes);

  TicketLock lock_;
  boost::asio::thread_pool small_{2}, medium_{2}, large_{1};
};

}  // namespace dlcs

#endif  // DLCS_SERVER_GATEWAY_TRANSLATORS_H_
