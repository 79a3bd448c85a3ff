// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/translators.h"

#include <memory>
#include <utility>

#include "boost/asio/async_result.hpp"
#include "boost/asio/post.hpp"
#include "boost/asio/use_awaitable.hpp"

namespace dlcs {

namespace asio = boost::asio;

namespace {

// Half a second of work at most, and four seconds.
constexpr std::size_t kSmallBytes = std::size_t{1} << 20;
constexpr std::size_t kMediumBytes = std::size_t{8} << 20;

}  // namespace

void Turns::Take() {
  std::unique_lock lock(mutex_);
  const std::uint64_t number = next_++;
  given_.wait(lock, [&] { return current_ == number; });
}

void Turns::Give() {
  {
    const std::lock_guard lock(mutex_);
    ++current_;
  }
  given_.notify_all();
}

asio::thread_pool& Translators::ThreadsFor(std::size_t bytes) {
  return bytes <= kSmallBytes ? small_ : bytes <= kMediumBytes ? medium_ : large_;
}

asio::awaitable<absl::StatusOr<std::string>> Translators::Run(std::size_t bytes, std::stop_token left,
                                                              asio::any_io_executor executor, Work work) {
  using Result = absl::StatusOr<std::string>;
  const auto result = std::make_shared<Result>();
  const auto translate = [this, left = std::move(left), work = std::move(work)]() -> Result {
    turns_.Take();
    Result translated = work([&] {
      turns_.Give();
      turns_.Take();
      return !left.stop_requested();
    });
    turns_.Give();
    return translated;
  };
  const auto initiate = [threads = &ThreadsFor(bytes), executor, translate, result](auto handler) {
    const auto kept = std::make_shared<decltype(handler)>(std::move(handler));
    asio::post(*threads, [executor, translate, result, kept] {
      *result = translate();
      asio::post(executor, [kept] { (*kept)(); });
    });
  };
  co_await asio::async_initiate<const asio::use_awaitable_t<>, void()>(initiate, asio::use_awaitable);
  co_return std::move(*result);
}

}  // namespace dlcs
