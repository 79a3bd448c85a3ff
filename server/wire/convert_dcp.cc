// SPDX-License-Identifier: Apache-2.0
#include "fmt/format.h"
#include "server/wire/convert.h"
#include "server/wire/convert_dense.h"

namespace dlcs {

PiecewiseLinearPath PathFromProto(const v1::PiecewiseLinearPath& path, Index n, const std::string& field,
                                  std::vector<Violation>& violations) {
  const auto times = static_cast<Index>(path.times_size());
  if (path.values_size() != n * times) {
    violations.push_back(
        {field, fmt::format("{} values; {} times of {} components need {}", path.values_size(), times, n, n * times)});
    return {};
  }
  return {{path.times().begin(), path.times().end()}, Eigen::Map<const Matrix>(path.values().data(), n, times)};
}

v1::PiecewiseLinearPath ToProto(const PiecewiseLinearPath& path) {
  v1::PiecewiseLinearPath result;
  result.mutable_times()->Add(path.times.begin(), path.times.end());
  Append(path.values, *result.mutable_values());
  return result;
}

v1::DcpCertificate ToProto(const DcpCertificate& certificate) {
  v1::DcpCertificate result;
  result.set_start(certificate.start);
  result.set_least_increase(certificate.least_increase);
  result.set_least_w(certificate.least_w);
  result.set_complementarity(certificate.complementarity);
  return result;
}

}  // namespace dlcs
