// SPDX-License-Identifier: Apache-2.0
// A proxy to a server on this machine whose connections can be cut, as in a real network.

#ifndef DLCS_TESTS_LOAD_CUT_PROXY_H_
#define DLCS_TESTS_LOAD_CUT_PROXY_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <mutex>
#include <string>
#include <thread>

namespace dlcs::testing {

// Forwards bytes between the clients of address() and `upstream`, on a thread of its own. Functions return when they
// have taken effect; they are safe from any thread.
class CutProxy {
 public:
  // `upstream` is 127.0.0.1:PORT; nobody need listen there yet. Throws std::system_error without sockets.
  explicit CutProxy(const std::string& upstream);
  ~CutProxy();
  CutProxy(const CutProxy&) = delete;
  CutProxy& operator=(const CutProxy&) = delete;

  // 127.0.0.1:PORT, the same for as long as the proxy lives.
  const std::string& address() const { return address_; }

  // Ends every connection at once, on both sides and without a goodbye (RST). What is on its way is lost.
  void Cut();
  // The same, and new connections are refused until Open().
  void Close();
  void Open();
  // Connections stay and nothing passes, until Stall(false) or a cut.
  void Stall(bool stalled);

 private:
  // Bytes that were read on one side and wait to be written on the other.
  struct Direction {
    int from;
    int to;
    std::string waiting;
  };
  struct Connection {
    Direction up;
    Direction down;
  };

  void Do(const std::function<void()>& what);
  void Run();
  void Listen();
  void Accept();
  void CutAll();
  // False when the connection is at its end.
  bool Pass(Direction& direction, short readable);

  const int upstream_port_;
  std::string address_;
  int port_ = 0;
  int reserved_ = -1;  // bound and never listening: while the proxy is closed, nobody else takes its port
  int wake_[2] = {-1, -1};

  // Used by the thread, with mutex_ held.
  std::mutex mutex_;
  int listener_ = -1;
  bool stalled_ = false;
  bool ending_ = false;
  std::list<Connection> connections_;
  std::thread thread_;
};

}  // namespace dlcs::testing

#endif  // DLCS_TESTS_LOAD_CUT_PROXY_H_
