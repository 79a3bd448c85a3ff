// SPDX-License-Identifier: Apache-2.0
// What servers on one PostgreSQL tell each other (NOTIFY), as text.

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_NOTICE_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_NOTICE_H_

#include <optional>
#include <string>
#include <vector>

#include "server/store/job_store.h"

namespace dlcs::jobs {

// The payloads for kWatched and kPassing, to be sent in this order within one transaction; PostgreSQL takes less than
// 8000 bytes in one. None for an event that is too large to be worth it: above 2 MB.
std::vector<std::string> NoticesOf(const JobChange& change);

// Puts together what arrives over one connection: the payloads of a transaction follow each other there.
class NoticeReader {
 public:
  // Nothing while more is to come, and for what this program does not understand: newer ones may say more.
  std::optional<JobChange> Read(const std::string& payload);

 private:
  std::optional<JobChange> ReadPart(const JobId& job, const std::string& part);

  JobId job_;  // of the parts so far
  int parts_ = 0;
  std::string text_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_NOTICE_H_
