// SPDX-License-Identifier: Apache-2.0
// A cache of what solves of the same matrices share: classes, schemes, kernels, factors.

#ifndef DLCS_CORE_SETUP_CACHE_H_
#define DLCS_CORE_SETUP_CACHE_H_

#include <condition_variable>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <unordered_map>

#include "core/linalg/structured_matrix.h"

namespace dlcs {

// The bytes of everything that a set-up depends on: equal keys mean equal matrices. A hash of them is used only for
// lookup.
class SetupKey {
 public:
  // `what` names the kind of value.
  explicit SetupKey(const std::string& what) : bytes_(what + '\0') {}
  SetupKey& Add(double number) { return AddBytes(&number, sizeof number); }
  SetupKey& Add(Index number) { return AddBytes(&number, sizeof number); }
  SetupKey& Add(const Matrix& matrix);
  SetupKey& Add(const SparseMatrix& matrix);
  // Of a matrix known by its products only, shape and number of entries: do not look up what depends on its values.
  SetupKey& Add(const StructuredMatrix& matrix);
  const std::string& bytes() const { return bytes_; }

 private:
  SetupKey& AddBytes(const void* data, std::size_t size);
  std::string bytes_;
};

// Values by their keys; the least recently used are dropped when the size exceeds a bound. If several threads request a
// value at once, one of them makes it and the others wait. Values are never changed, and stay alive as long as somebody
// holds them. Safe from any thread.
class SetupCache {
 public:
  // `max_bytes` counts keys and values.
  explicit SetupCache(double max_bytes) : max_bytes_(max_bytes) {}

  template <class Value>
  struct Made {
    std::shared_ptr<const Value> value;
    double bytes = 0;  // its memory
  };
  // The value of `key`, made by `make` if there is none. A null value is returned but not kept. Exceptions of `make`
  // are passed on.
  template <class Value>
  std::shared_ptr<const Value> Get(const SetupKey& key, const std::function<Made<Value>()>& make) {
    return std::static_pointer_cast<const Value>(GetAny(key, [&]() -> Made<void> {
      Made<Value> made = make();
      return {std::move(made.value), made.bytes};
    }));
  }

  struct Statistics {
    Index hits = 0;
    Index misses = 0;
    Index dropped = 0;
    Index values = 0;
    double bytes = 0;
  };
  Statistics statistics() const;

 private:
  struct Entry {
    std::string key;
    std::shared_ptr<const void> value;  // null while it is being made
    double bytes = 0;
  };
  std::shared_ptr<const void> GetAny(const SetupKey& key, const std::function<Made<void>()>& make);
  void DropBeyondBound();
  // Removes an entry that got no value.
  void Forget(std::list<Entry>::iterator entry);

  const double max_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable made_;
  std::list<Entry> entries_;  // the most recently used one is first
  std::unordered_map<std::string_view, std::list<Entry>::iterator> by_key_;
  Statistics statistics_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_SETUP_CACHE_H_
