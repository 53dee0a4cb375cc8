// The volume of a session as the master knows it: what its data servers say of it, the transfer function and step of
// the current epoch, and what changes them. No sockets, no clocks.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/volume/session.h"
#include "common/wire/messages.h"
#include "services/master/control.h"

namespace telesplat::master {

class VolumeScene {
 public:
  /// A data server and the part of the volume it holds.
  struct Server {
    std::string name, endpoint;
    InstanceId instance;
    int begin = 0, end = 0;      ///< slices
    double bytes_per_voxel = 0;  ///< 0: it did not say yet
    bool here = false;
  };
  /// What a hello changed.
  struct Change {
    bool another = false;  ///< volume: grid, levels or number of steps, or the data behind them
    bool values = false;   ///< transfer function or step, or the scene is complete now
    bool servers = false;  ///< who holds what, and where
  };

  /// A data server of kind "volume" said hello. A server that says the same as the one before of its part (it was
  /// restarted) changes no values: what was set since stays. Error: what it says cannot be, does not fit the parts that
  /// are here, or its part is held by another; then nothing changed.
  Result<Change> adopt(const wire::Hello& data);
  /// The server is gone; the scene stays.
  void leave(InstanceId data);

  /// Data servers for all parts have been there.
  bool complete() const;
  /// Precondition of what follows: complete().
  const volume::Session& session() const { return session_; }
  /// For the welcome, in this epoch.
  std::map<std::string, double> values() const;
  std::map<std::string, std::string> facts() const;
  const geometry::Box& box_room() const { return box_room_; }
  /// In the order of their parts, also those that are away.
  const std::vector<Server>& servers() const { return servers_; }

  /// How many voxels of each slice are visible. Ignored: epochs older than the server's last. True: taken. Error: from
  /// nobody known, slices that it does not hold.
  Result<bool> weigh(const wire::SliceWeights& m);
  /// All servers said it at least once.
  bool weighed() const;
  /// One a slice; 0 where nothing was said.
  const std::vector<uint32_t>& weights() const { return weights_; }
  /// Expected for these slices, of one server; 4 bytes a voxel where it did not say.
  uint64_t bytes(const Server& server, int begin, int end) const;
  /// Mean over what is visible; 0: nothing was said.
  double bytes_per_voxel() const;

  /// "tf": a preset's name, or points. Error: neither; then nothing changed.
  Status set_transfer(const std::string& text);
  /// "set": volume.step stops the playing, volume.steps-per-s (0 or above) begins or stops it. Error: other names,
  /// limits; then nothing changed.
  Status set(const std::map<std::string, std::string>& arguments);
  /// "play": goes on, pauses, or pauses some steps farther on or back, round and round. Error: a volume of one step.
  /// True: the step is another one.
  Result<bool> play(const PlayOrder& order);
  /// "animate": on, off.
  Status animate(const std::string& text);

  bool playing() const { return playing_ && session_.steps > 1 && session_.steps_per_s > 0; }
  /// Takes the step of now_s; its clock begins with the first call. True: it is another than before.
  bool step(double now_s);

 private:
  Status fits(const volume::Session& session, const wire::Hello& data) const;
  void begin(const volume::Session& session);

  volume::Session session_;  // of this epoch
  geometry::Box box_room_;
  std::map<std::string, double> parameters_;  // the first part's hello
  std::map<std::string, std::string> facts_;
  std::vector<Server> servers_;        // one a part
  std::vector<volume::Session> told_;  // by each
  std::vector<std::string> content_hash_;
  std::vector<bool> known_;                      // a server of the part was there
  std::vector<std::optional<EpochId>> weighed_;  // by each, for that epoch
  std::vector<uint32_t> weights_;
  bool playing_ = true;
  std::optional<double> begun_s_;
  int first_step_ = 0;  // at begun_s_
};

}  // namespace telesplat::master
