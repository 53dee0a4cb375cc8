// What a data server serves: one implementation a kind of scene. The serve loop (data_service.cpp) is the same for all
// of them.
#pragma once

#include <fmt/format.h>

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/result.h"
#include "common/net/socket.h"
#include "common/scene/kind.h"
#include "common/wire/messages.h"

namespace telesplat::data {

/// Where answers go. They may be dropped: who asked asks again.
struct Outlets {
  net::Socket& requests;  ///< to those who ask, by Message::peer
  net::Socket& master;
};

/// An open data set. All calls come from the thread of the serve loop; none waits for long.
class Served {
 public:
  /// The socket that requests come to.
  struct Requests {
    std::string_view
        endpoint;  ///< under which the session tells where to ask: "chunks"; empty: there is nothing to ask for
    int high_water_mark = 0;  ///< answers that wait for a peer at most
  };

  virtual ~Served() = default;
  virtual scene::Kind kind() const = 0;
  /// For people: a file's name, or what else the scene is called. Any bytes.
  virtual std::string title() const = 0;
  /// For the log: how large it is.
  virtual std::string summary() const = 0;
  /// What people should know of how it was read: lines that name the file.
  virtual std::vector<std::string> notes() const { return {}; }
  /// Adds what the session is told of it: facts, parameters, the box in the room.
  virtual void describe(wire::Hello& hello) const = 0;
  /// Its tables of session.toml, "\n[scene]\nkind = ..."; empty: its file and the flags tell all (record.h).
  virtual std::string record() const { return {}; }
  virtual Requests requests() const { return {}; }

  /// Called once, before what follows. self: this data server.
  virtual void begin(InstanceId /*self*/) {}
  /// The session has changed. Error: it is not this scene's.
  virtual Status follow(const wire::Welcome& /*session*/) { return ok_status(); }
  /// Answers a request, now or later. A message that is none is rejected at its socket.
  virtual void answer(const net::Message& /*request*/, const Outlets& /*outlets*/) {}
  /// An order of the master's. Its answer; nothing: it will be answered over outlets.master. Error: why not.
  virtual Result<std::optional<std::string>> carry_out(const wire::Order& order) {
    return Error{fmt::format("a data server of {} does not know the order '{}'", scene::described(kind()),
                             order.command.substr(0, 64))};
  }
  /// Sends what has been worked off meanwhile, where that has a thread of its own.
  virtual void send_finished(const Outlets& /*outlets*/) {}
  /// Facts of the hello that have changed since it was last asked: the master is told.
  virtual std::map<std::string, std::string> news() { return {}; }
  /// True: something is worked on or waits to be sent, though no message comes.
  virtual bool busy() const { return false; }
  virtual void add_status(std::map<std::string, double>& /*values*/) const {}
};

}  // namespace telesplat::data
