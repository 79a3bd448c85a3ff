// SPDX-License-Identifier: Apache-2.0
#include "server/gateway/transcoder_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "boost/asio/co_spawn.hpp"
#include "boost/asio/detached.hpp"
#include "boost/asio/io_context.hpp"

namespace dlcs {
namespace {

using Result = absl::StatusOr<std::string>;

constexpr std::size_t kSmall = 100'000, kLarge = 50'000'000;

class TranscoderPoolTest : public ::testing::Test {
 protected:
  // Starts a conversion of so many bytes, and returns its future result.
  std::future<Result> Start(std::size_t bytes, TranscoderPool::Work work, std::stop_token left = {}) {
    auto promise = std::make_shared<std::promise<Result>>();
    std::future<Result> future = promise->get_future();
    boost::asio::co_spawn(
        context_,
        [this, bytes, work = std::move(work), left = std::move(left), promise]() mutable {
          return Await(bytes, std::move(work), std::move(left), promise);
        },
        boost::asio::detached);
    return future;
  }

  boost::asio::awaitable<void> Await(std::size_t bytes, TranscoderPool::Work work, std::stop_token left,
                                     std::shared_ptr<std::promise<Result>> promise) {
    boost::asio::any_io_executor executor = context_.get_executor();
    Result result = co_await transcoders_.Run(bytes, std::move(left), std::move(executor), std::move(work));
    promise->set_value(std::move(result));
  }

  boost::asio::io_context context_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> guard_{context_.get_executor()};
  std::jthread thread_{[this] { context_.run(); }};
  TranscoderPool transcoders_;
  // Before the thread is joined.
  std::unique_ptr<boost::asio::io_context, void (*)(boost::asio::io_context*)> stop_{
      &context_, [](boost::asio::io_context* context) { context->stop(); }};
};

TEST_F(TranscoderPoolTest, ASmallOneEndsWhileLargeOnesGoOn) {
  std::atomic<bool> small_ended = false;
  const TranscoderPool::Work until_small_ended = [&](const std::function<bool()>& is_wanted) -> Result {
    while (!small_ended) {
      if (!is_wanted()) return absl::CancelledError();
    }
    return "large";
  };
  std::vector<std::future<Result>> large;
  for (int k = 0; k < 5; ++k) large.push_back(Start(kLarge, until_small_ended));
  Result small = Start(kSmall, [](const std::function<bool()>& is_wanted) -> Result {
                   for (int k = 0; k < 10; ++k) is_wanted();
                   return "small";
                 }).get();
  EXPECT_EQ(small.value(), "small");
  small_ended = true;
  for (auto& one : large) EXPECT_EQ(one.get().value(), "large");
}

TEST_F(TranscoderPoolTest, OneWorksAtATime) {
  std::atomic<int> working = 0, most = 0;
  const TranscoderPool::Work count = [&](const std::function<bool()>& is_wanted) -> Result {
    for (int k = 0; k < 20; ++k) {
      most = std::max<int>(most, ++working);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      --working;
      is_wanted();
    }
    return "";
  };
  std::vector<std::future<Result>> all;
  for (const std::size_t bytes : {kSmall, kLarge, kSmall, std::size_t{4'000'000}}) all.push_back(Start(bytes, count));
  for (auto& one : all) EXPECT_TRUE(one.get().ok());
  EXPECT_EQ(most, 1);
}

TEST_F(TranscoderPoolTest, EndsWithItsClient) {
  std::stop_source left;
  std::promise<void> begun;
  std::future<Result> endless = Start(
      kLarge,
      [&](const std::function<bool()>& is_wanted) -> Result {
        begun.set_value();
        while (is_wanted()) std::this_thread::yield();
        return absl::CancelledError("gone");
      },
      left.get_token());
  begun.get_future().get();
  left.request_stop();
  EXPECT_EQ(endless.get().status().message(), "gone");
}

}  // namespace
}  // namespace dlcs
