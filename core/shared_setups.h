// SPDX-License-Identifier: Apache-2.0
// The cache in which a propagator keeps its set-ups.

#ifndef DLCS_CORE_SHARED_SETUPS_H_
#define DLCS_CORE_SHARED_SETUPS_H_

#include <memory>

#include "core/setup_cache.h"

namespace dlcs {

// A shared cache, or an own one if there is none.
class SharedSetups {
 public:
  // `shared` may be null; otherwise it must outlive this. `own_bytes` bounds the size of an own cache.
  SharedSetups(SetupCache* shared, double own_bytes)
      : own_(shared ? nullptr : std::make_unique<SetupCache>(own_bytes)), cache_(shared ? shared : own_.get()) {}

  SetupCache* operator->() const { return cache_; }
  SetupCache* get() const { return cache_; }

 private:
  std::unique_ptr<SetupCache> own_;
  SetupCache* cache_;
};

}  // namespace dlcs

#endif  // DLCS_CORE_SHARED_SETUPS_H_
