// SPDX-License-Identifier: Apache-2.0
// A few threads for work that must not run on gRPC's threads: solves, conversions, single LCPs.

#ifndef DLCS_SERVER_RPC_WORKER_POOL_H_
#define DLCS_SERVER_RPC_WORKER_POOL_H_

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace dlcs {

// Tasks start in the order of submission. They must not throw. The queue is not bounded; callers limit its length by
// admission.
class WorkerPool {
 public:
  explicit WorkerPool(int num_threads);
  // Runs the queued tasks, then joins the threads.
  ~WorkerPool();

  void Run(std::function<void()> task);

 private:
  void Work();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> tasks_;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace dlcs

#endif  // DLCS_SERVER_RPC_WORKER_POOL_H_
