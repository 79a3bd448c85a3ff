// SPDX-License-Identifier: Apache-2.0
// Who a client is by its certificate.

#ifndef DLCS_SERVER_HTTP_CERTIFICATE_NAMES_H_
#define DLCS_SERVER_HTTP_CERTIFICATE_NAMES_H_

#include <openssl/ossl_typ.h>

#include <string>
#include <vector>

namespace dlcs {

// The common names and the alternative names (hosts, addresses of the internet and of mail, URIs), as gRPC has them in
// the properties of a peer.
std::vector<std::string> NamesIn(X509& certificate);

}  // namespace dlcs

#endif  // DLCS_SERVER_HTTP_CERTIFICATE_NAMES_H_
