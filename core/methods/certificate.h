// SPDX-License-Identifier: Apache-2.0
// Measures how well a trajectory satisfies the system, segment by segment.

#ifndef DLCS_CORE_METHODS_CERTIFICATE_H_
#define DLCS_CORE_METHODS_CERTIFICATE_H_

#include "core/methods/scheme.h"
#include "core/methods/segment.h"
#include "core/problem.h"
#include "core/solution.h"

namespace dlcs {

class CertificateBuilder {
 public:
  explicit CertificateBuilder(const Problem& problem);

  // Adds the nodes and midpoints of `segment`, whose states follow `scheme`. Independent of how y was found:
  // w is formed anew from x and y. Cost: a few products of m × m, m × n and n × n matrices with `steps` columns.
  void Add(const Segment& segment, const Scheme& scheme);

  // NaN throughout until a step was added.
  const Certificate& certificate() const { return certificate_; }

 private:
  const Problem& problem_;
  Certificate certificate_;
  bool empty_ = true;
};

}  // namespace dlcs

#endif  // DLCS_CORE_METHODS_CERTIFICATE_H_
