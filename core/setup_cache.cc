// SPDX-License-Identifier: Apache-2.0
#include "core/setup_cache.h"

#include <chrono>
#include <utility>

#include "core/parallel/stop_scope.h"

namespace dlcs {

SetupKey& SetupKey::AddBytes(const void* data, std::size_t size) {
  bytes_.append(static_cast<const char*>(data), size);
  return *this;
}

SetupKey& SetupKey::Add(const Matrix& matrix) {
  Add(matrix.rows()).Add(matrix.cols());
  return AddBytes(matrix.data(), static_cast<std::size_t>(matrix.size()) * sizeof(double));
}

SetupKey& SetupKey::Add(const SparseMatrix& matrix) {
  Add(matrix.rows()).Add(matrix.cols()).Add(matrix.nonZeros());
  for (Index j = 0; j < matrix.outerSize(); ++j) {
    for (SparseMatrix::InnerIterator entry(matrix, j); entry; ++entry) {
      Add(entry.row()).Add(entry.col()).Add(entry.value());
    }
  }
  return *this;
}

SetupKey& SetupKey::Add(const StructuredMatrix& matrix) {
  if (matrix.is_dense()) return Add(Index{0}).Add(matrix.Dense());
  if (matrix.sparse()) return Add(Index{1}).Add(*matrix.sparse());
  if (matrix.linear_operator()) return Add(Index{3}).Add(matrix.rows()).Add(matrix.cols()).Add(matrix.nonzeros());
  Add(Index{2}).Add(static_cast<Index>(matrix.kronecker_sum()->factors.size()));
  for (const SparseMatrix& factor : matrix.kronecker_sum()->factors) Add(factor);
  return *this;
}

std::shared_ptr<const void> SetupCache::GetAny(const SetupKey& key, const std::function<Made<void>()>& make) {
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto found = by_key_.find(key.bytes());
    if (found == by_key_.end()) break;
    if (found->second->value) {
      ++statistics_.hits;
      entries_.splice(entries_.begin(), entries_, found->second);
      return found->second->value;
    }
    // The thread that makes the value cannot wake a waiting thread that is to stop, so this one looks for itself.
    made_.wait_for(lock, std::chrono::milliseconds(5));
    LookForStop();
  }
  ++statistics_.misses;
  entries_.push_front({key.bytes(), nullptr, 0});
  const auto entry = entries_.begin();
  by_key_.emplace(entry->key, entry);
  lock.unlock();

  Made<void> made;
  try {
    made = make();
  } catch (...) {  // out of memory, or stopped: a waiting thread makes the value instead
    lock.lock();
    Forget(entry);
    throw;
  }

  lock.lock();
  if (made.value) {
    entry->value = made.value;
    entry->bytes = made.bytes + 2.0 * static_cast<double>(entry->key.size());
    statistics_.bytes += entry->bytes;
    ++statistics_.values;
    DropBeyondBound();
    made_.notify_all();
  } else {
    Forget(entry);
  }
  return made.value;
}

void SetupCache::Forget(std::list<Entry>::iterator entry) {
  by_key_.erase(entry->key);
  entries_.erase(entry);
  made_.notify_all();
}

// The newest value is kept whatever its size: it is in use.
void SetupCache::DropBeyondBound() {
  auto entry = entries_.end();
  while (statistics_.bytes > max_bytes_ && entry != entries_.begin()) {
    --entry;
    if (entry == entries_.begin() || !entry->value) continue;
    statistics_.bytes -= entry->bytes;
    --statistics_.values;
    ++statistics_.dropped;
    by_key_.erase(entry->key);
    entry = entries_.erase(entry);
  }
}

SetupCache::Statistics SetupCache::statistics() const {
  const std::lock_guard lock(mutex_);
  return statistics_;
}

}  // namespace dlcs
