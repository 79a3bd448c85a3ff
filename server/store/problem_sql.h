// SPDX-License-Identifier: Apache-2.0
// SQL about uploaded problems that is the same for both databases.

#ifndef DLCS_SERVER_STORE_PROBLEM_SQL_H_
#define DLCS_SERVER_STORE_PROBLEM_SQL_H_

#define DLCS_PROBLEM_COLUMNS "number, id, about, bytes, created, used"

// True for a problem that an unfinished job needs. In PostgreSQL it belongs in a statement after the one that locked
// the problem, which sees everything that was committed before the lock was granted.
#define DLCS_HELD                                                                                               \
  "EXISTS (SELECT 1 FROM jobs WHERE finished IS NULL AND jobs.problem <> '' AND jobs.problem = problems.id AND" \
  " jobs.owner = problems.owner)"

#endif  // DLCS_SERVER_STORE_PROBLEM_SQL_H_
