// SPDX-License-Identifier: Apache-2.0
// All methods of all services that are compiled in, new ones included.

#ifndef DLCS_TESTS_SERVER_ACCESS_ALL_METHODS_H_
#define DLCS_TESTS_SERVER_ACCESS_ALL_METHODS_H_

#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor_database.h>

#include <string>
#include <vector>

namespace dlcs::testing {

// "/dlcs.v1.JobService/GetSolveJob", ...: of the services for clients. dlcs.ranks.RankLink has a port and a secret of
// its own.
inline std::vector<std::string> PathsOfAllMethods() {
  std::vector<std::string> files, paths;
  google::protobuf::DescriptorPool::internal_generated_database()->FindAllFileNames(&files);
  for (const std::string& name : files) {
    const auto* const file = google::protobuf::DescriptorPool::generated_pool()->FindFileByName(name);
    if (file->package() == "dlcs.ranks") continue;
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        paths.push_back("/" + file->service(s)->full_name() + "/" + file->service(s)->method(m)->name());
      }
    }
  }
  return paths;
}

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_SERVER_ACCESS_ALL_METHODS_H_
