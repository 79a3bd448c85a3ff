// SPDX-License-Identifier: Apache-2.0
// The buffer between the members of one ensemble and their reader. Nothing is dropped; memory is bounded by letting
// members wait.

#ifndef DLCS_SERVER_RPC_ENSEMBLE_BUFFER_H_
#define DLCS_SERVER_RPC_ENSEMBLE_BUFFER_H_

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "dlcs/v1/solver.pb.h"
#include "server/rpc/event_buffer.h"
#include "server/session/ensemble_session.h"

namespace dlcs {

// A member reserves memory for its result (PreparedEnsemble::result_bytes) when it starts, and releases it when the
// reader has taken its summary. If no memory is left, further members wait to be started. Results are kept as the
// engine returned them; chunks are made one by one when the reader asks for them.
//
// MayBegin() and Finished() come from the threads of the engine, Open() and Close() from the one that runs it, Next()
// from any thread, one call at a time.
class EnsembleBuffer final : public EnsembleSink {
 public:
  using Got = EventBuffer::Got;

  // To be called before the engine runs: puts the first event, and reserves prepared.held_bytes.
  void Open(const std::string& solve_id, const PreparedEnsemble& prepared);
  bool MayBegin(Index member, const std::stop_token& stop) override;
  void Finished(Index member, FinishedSolve solve) override;
  // No more members: the summary becomes the last event, or the error the status of the call.
  void Close(absl::StatusOr<v1::EnsembleSummary> summary);

  Got Next(v1::EnsembleEvent& event);
  // As in EventBuffer.
  bool has_more() const;
  bool delivered() const;

  bool closed() const;
  // OK before Close(), then OK or the error passed to it.
  absl::Status status() const;
  std::int64_t held_bytes() const;

 private:
  struct Member {
    Index member = 0;
    FinishedSolve solve;
  };
  bool NextOfMembers(v1::EnsembleEvent& event);

  mutable std::mutex mutex_;
  std::condition_variable_any room_;
  std::vector<std::int64_t> result_bytes_;  // of the members
  std::int64_t most_bytes_ = 0;
  std::int64_t held_bytes_ = 0;
  std::optional<EnsembleWriter> writer_;
  std::optional<v1::EnsembleEvent> accepted_;
  std::deque<Member> members_;
  std::optional<absl::StatusOr<v1::EnsembleSummary>> summary_;
  bool summary_made_ = false;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_ENSEMBLE_BUFFER_H_
