// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/transcoder_pool.h"

#include <memory>
#include <utility>

#include "boost/asio/async_result.hpp"
#include "boost/asio/post.hpp"
#include "boost/asio/use_awaitable.hpp"

namespace dlcs {

namespace asio = boost::asio;

namespace {

// At most half a second of work, and at most four seconds.
constexpr std::size_t kSmallBytes = std::size_t{1} << 20;
constexpr std::size_t kMediumBytes = std::size_t{8} << 20;

}  // namespace

void TicketLock::Lock() {
  std::unique_lock lock(mutex_);
  const std::uint64_t number = next_++;
  unlocked_.wait(lock, [&] { return current_ == number; });
}

void TicketLock::Unlock() {
  {
    const std::lock_guard lock(mutex_);
    ++current_;
  }
  unlocked_.notify_all();
}

asio::thread_pool& TranscoderPool::ThreadsFor(std::size_t bytes) {
  return bytes <= kSmallBytes ? small_ : bytes <= kMediumBytes ? medium_ : large_;
}

asio::awaitable<absl::StatusOr<std::string>> TranscoderPool::Run(std::size_t bytes, std::stop_token disconnected,
                                                                 asio::any_io_executor executor, Work work) {
  using Result = absl::StatusOr<std::string>;
  const auto result = std::make_shared<Result>();
  const auto transcode = [this, disconnected = std::move(disconnected), work = std::move(work)]() -> Result {
    lock_.Lock();
    Result transcoded = work([&] {
      lock_.Unlock();
      lock_.Lock();
      return !disconnected.stop_requested();
    });
    lock_.Unlock();
    return transcoded;
  };
  const auto initiate = [threads = &ThreadsFor(bytes), executor, transcode, result](auto handler) {
    const auto kept = std::make_shared<decltype(handler)>(std::move(handler));
    asio::post(*threads, [executor, transcode, result, kept] {
      *result = transcode();
      asio::post(executor, [kept] { (*kept)(); });
    });
  };
  co_await asio::async_initiate<const asio::use_awaitable_t<>, void()>(initiate, asio::use_awaitable);
  co_return std::move(*result);
}

}  // namespace dlcs
