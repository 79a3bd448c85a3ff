// SPDX-License-Identifier: Apache-2.0
#include "server/solve_jobs/rank_messages.h"

#include <string>
#include <utility>

#include "server/wire/status.h"

namespace dlcs {
namespace {

using Values = google::protobuf::RepeatedField<double>;

void AddTo(Values& values, const Matrix& columns) { values.Add(columns.data(), columns.data() + columns.size()); }

Matrix ColumnsOf(const Values& values, Index rows, Index columns) {
  return Eigen::Map<const Matrix>(values.data(), rows, columns);
}

}  // namespace

ranks::Window ToProto(jobs::AcceptedWindow window) {
  ranks::Window result;
  result.set_begin(window.begin);
  result.set_end(window.end);
  result.set_trajectory(std::move(window.trajectory));
  if (window.state) result.set_state(*std::move(window.state));
  result.set_event(std::move(window.event));
  result.set_progress(window.progress);
  return result;
}

jobs::AcceptedWindow FromProto(ranks::Window window) {
  jobs::AcceptedWindow result;
  result.begin = window.begin();
  result.end = window.end();
  result.trajectory = std::move(*window.mutable_trajectory());
  if (window.has_state()) result.state = std::move(*window.mutable_state());
  result.event = std::move(*window.mutable_event());
  result.progress = window.progress();
  return result;
}

ranks::End ToProto(const jobs::JobEnd& end) {
  ranks::End result;
  const grpc::Status status = ToGrpc(end.status);
  result.set_code(end.status.raw_code());
  result.set_message(status.error_message());
  result.set_details(status.error_details());
  result.set_summary(end.summary);
  return result;
}

jobs::JobEnd FromProto(const ranks::End& end) {
  const grpc::Status status(static_cast<grpc::StatusCode>(end.code()), end.message(), end.details());
  return {end.code() == 0 ? absl::OkStatus() : FromGrpc(status), end.summary()};
}

ranks::Detail ToProto(const jobs::EventDetail& detail) {
  ranks::Detail result;
  result.set_most_times(static_cast<std::int64_t>(detail.most_times));
  result.mutable_components()->Add(detail.components.begin(), detail.components.end());
  return result;
}

jobs::EventDetail FromProto(const ranks::Detail& detail) {
  return {.most_times = static_cast<std::size_t>(detail.most_times()),
          .components = {detail.components().begin(), detail.components().end()}};
}

void AddEarlier(const EarlierAttempts& earlier, ranks::Work& work) {
  if (earlier.state) work.set_state(*earlier.state);
  work.set_columns(earlier.trajectory.x.cols());
  AddTo(*work.mutable_x(), earlier.trajectory.x);
  AddTo(*work.mutable_y(), earlier.trajectory.y);
  AddTo(*work.mutable_w(), earlier.trajectory.w);
}

absl::StatusOr<EarlierAttempts> EarlierIn(const ranks::Work& work, Index states, Index constraints) {
  const Index columns = work.columns();
  const bool fits = work.x_size() == states * columns && work.y_size() == constraints * columns &&
                    work.w_size() == constraints * columns;
  if (!fits) return absl::InternalError("The trajectory of earlier attempts does not fit the problem.");
  EarlierAttempts earlier;
  if (work.has_state()) earlier.state = work.state();
  earlier.trajectory = {ColumnsOf(work.x(), states, columns), ColumnsOf(work.y(), constraints, columns),
                        ColumnsOf(work.w(), constraints, columns)};
  return earlier;
}

}  // namespace dlcs
