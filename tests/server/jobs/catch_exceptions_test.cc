// SPDX-License-Identifier: Apache-2.0
#include "server/jobs/catch_exceptions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <new>
#include <sstream>
#include <string>

#include "absl/status/statusor.h"
#include "spdlog/sinks/ostream_sink.h"

namespace dlcs {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// Runs `work`, which throws, and checks that the caller gets only the id of the error, and the log gets all of it.
void ExpectInternal(absl::StatusOr<int> (*work)(), const std::string& secret) {
  const std::shared_ptr<spdlog::logger> logger = spdlog::default_logger();
  std::ostringstream log;
  const auto capturing =
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log));
  spdlog::set_default_logger(capturing);
  const absl::Status status = CatchExceptions("solve-7", work).status();
  spdlog::set_default_logger(logger);
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal);
  EXPECT_THAT(std::string(status.message()), HasSubstr("solve-7"));
  EXPECT_THAT(std::string(status.message()), Not(HasSubstr(secret)));
  EXPECT_THAT(log.str(), HasSubstr("solve-7"));
  EXPECT_THAT(log.str(), HasSubstr(secret));
}

TEST(CatchExceptionsTest, ExceptionsBecomeInternalAndGoToTheLog) {
  ExpectInternal([]() -> absl::StatusOr<int> { throw std::bad_alloc(); }, "bad_alloc");
  ExpectInternal([]() -> absl::StatusOr<int> { throw 7; }, "not a std::exception");
}

TEST(CatchExceptionsTest, ResultsPassUnchanged) {
  EXPECT_EQ(*CatchExceptions("solve-7", []() -> absl::StatusOr<int> { return 42; }), 42);
}

}  // namespace
}  // namespace dlcs
