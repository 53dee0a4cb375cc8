// The volume of a session as the master knows it: the hellos of its data servers, the transfer function and step of the
// current epoch, and the commands that change them. No sockets, no clocks.
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
    double bytes_per_voxel = 0;  ///< 0: not reported yet
    bool here = false;
  };
  /// Changes that a hello made.
  struct Change {
    bool another = false;  ///< it is another volume: grid, levels, steps or parts, or the data behind them
    bool values = false;   ///< transfer function or step, or the scene is complete now
    bool servers = false;  ///< a server came, or has another address
  };

  /// A data server of kind "volume" said hello. A server that says the same as the one before of its part (it was
  /// restarted) changes no values: those set since stay. Error: what it says is impossible or does not fit the parts
  /// that are here, or another server holds its part; then nothing changed.
  Result<Change> adopt(const wire::Hello& data);
  /// The server is gone; the scene stays.
  void leave(InstanceId data);

  /// True if data servers of all parts have been here.
  bool complete() const;
  /// Precondition of all functions below: complete().
  const volume::Session& session() const { return session_; }
  /// Parameters and facts for the welcome, in this epoch.
  std::map<std::string, double> values() const;
  std::map<std::string, std::string> facts() const;
  const geometry::Box& box_room() const { return box_room_; }
  /// In the order of their parts, also those that are away.
  const std::vector<Server>& servers() const { return servers_; }

  /// Takes the number of visible voxels of each slice. False: ignored, as the epoch is older than the server's last.
  /// Error: the sender has no part, or does not hold these slices.
  Result<bool> weigh(const wire::SliceWeights& m);
  /// True if all servers sent weights at least once.
  bool weighed() const;
  /// Visible voxels of each slice; 0: not reported.
  const std::vector<uint32_t>& weights() const { return weights_; }
  /// Expected bytes of these slices from one server; 4 bytes a voxel if it did not report a figure.
  uint64_t bytes(const Server& server, int begin, int end) const;
  /// Mean over all visible voxels; 0: not reported.
  double bytes_per_voxel() const;

  /// "tf": a preset's name, or points. Error: it is neither, or too long; then nothing changed.
  Status set_transfer(const std::string& text);
  /// "set": volume.step stops the playing, volume.steps-per-s (0 or above) begins or stops it. Error: other names, or
  /// a value out of limits; then nothing changed.
  Status set(const std::map<std::string, std::string>& arguments);
  /// "play": goes on, pauses, or pauses some steps farther on or back, cyclically. Error: the volume has one step, or
  /// 0 steps a second. True: the step changed.
  Result<bool> play(const PlayOrder& order);
  /// "animate": on, off.
  Status animate(const std::string& text);

  bool playing() const { return playing_ && session_.steps > 1 && session_.steps_per_s > 0; }
  /// Takes the step of now_s; its clock begins with the first call. True: the step changed.
  bool step(double now_s);

 private:
  Status fits(const volume::Session& session, const wire::Hello& data) const;
  void begin(const volume::Session& session);

  volume::Session session_;  // in this epoch
  geometry::Box box_room_;
  std::map<std::string, double> parameters_;  // from the first part's hello
  std::map<std::string, std::string> facts_;
  std::vector<Server> servers_;        // one for each part
  std::vector<volume::Session> told_;  // as each server sent it
  std::vector<std::string> content_hash_;
  std::vector<bool> known_;                      // a server of the part has been here
  std::vector<std::optional<EpochId>> weighed_;  // epoch of each server's newest weights
  std::vector<uint32_t> weights_;
  bool playing_ = true;
  std::optional<double> begun_s_;
  int first_step_ = 0;  // at begun_s_
};

}  // namespace telesplat::master
