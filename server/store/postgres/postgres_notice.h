// SPDX-License-Identifier: Apache-2.0
// The notifications between servers on one PostgreSQL (NOTIFY), as text.

#ifndef DLCS_SERVER_STORE_POSTGRES_POSTGRES_NOTICE_H_
#define DLCS_SERVER_STORE_POSTGRES_POSTGRES_NOTICE_H_

#include <optional>
#include <string>
#include <vector>

#include "server/store/job_store.h"

namespace dlcs::jobs {

// The payloads for kFollowed, kWatched and kTransient, to be sent in this order within one transaction; PostgreSQL
// takes less than 8000 bytes in one. Empty for events above 2 MB, which are not sent.
std::vector<std::string> NoticesOf(const JobChange& change);

// Assembles changes from the payloads received on one connection, where those of a transaction are consecutive.
class NoticeReader {
 public:
  // Absent while parts are missing, and for unknown payloads of newer versions.
  std::optional<JobChange> Read(const std::string& payload);

 private:
  std::optional<JobChange> ReadPart(const JobId& job, const std::string& part);

  JobId job_;  // of the parts so far
  int parts_ = 0;
  std::string text_;
};

}  // namespace dlcs::jobs

#endif  // DLCS_SERVER_STORE_POSTGRES_POSTGRES_NOTICE_H_
