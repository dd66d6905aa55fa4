#include "power_channels.hpp"

namespace lostmotion {

PowerChannels power_channels(const model::Assembly& a, const std::vector<TrainChannel>& channels) {
    const model::Train& t = a.train();
    const auto channel = [&](TrainChannel::Kind kind, int index) {
        std::size_t k = 0;
        while (channels[k].kind != kind || channels[k].index != index) ++k;
        return static_cast<int>(k);
    };
    const auto speed = [&](int shaft) {
        const model::ShaftPlace& p = a.places().shafts[shaft];
        return p.massless == model::nowhere ? channel(TrainChannel::state, p.speed)
                                            : channel(TrainChannel::massless_speed, p.massless);
    };
    PowerChannels out;
    for (std::size_t m = 0; m < t.motors.size(); ++m)
        out.motors.push_back({channel(TrainChannel::motor_torque, static_cast<int>(m)), speed(t.motors[m].shaft)});
    for (std::size_t g = 0; g < t.gears.size(); ++g) {
        const model::Gear& gear = t.gears[g];
        const bool last = std::none_of(t.gears.begin(), t.gears.end(),
                                       [&](const model::Gear& other) { return other.input == gear.output; });
        out.gears.push_back({{channel(TrainChannel::input_torque, static_cast<int>(g)), speed(gear.input)},
                             {channel(TrainChannel::output_torque, static_cast<int>(g)), speed(gear.output)},
                             last,
                             gear.housing == model::nowhere ? -1 : speed(gear.housing)});
    }
    return out;
}

}  // namespace lostmotion
