// SPDX-License-Identifier: Apache-2.0
// Work spaces that are lent to the thread that needs one.

#ifndef DLCS_CORE_PARALLEL_POOL_H_
#define DLCS_CORE_PARALLEL_POOL_H_

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace dlcs {

// Keeps objects that are dear to make between uses: there are never more than were in use at one time. Safe
// to share between threads. Which of them a caller gets is a matter of chance, so nothing may depend on what
// one was used for.
template <typename T>
class Pool {
 public:
  // An object handed in earlier, or a new one from `make`, which returns a std::unique_ptr<T>.
  template <typename Make>
  std::unique_ptr<T> Take(Make&& make) {
    {
      const std::lock_guard lock(mutex_);
      if (!idle_.empty()) {
        std::unique_ptr<T> taken = std::move(idle_.back());
        idle_.pop_back();
        return taken;
      }
    }
    return make();
  }

  void Return(std::unique_ptr<T> object) {
    const std::lock_guard lock(mutex_);
    idle_.push_back(std::move(object));
  }

 private:
  std::mutex mutex_;
  std::vector<std::unique_ptr<T>> idle_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_PARALLEL_POOL_H_
