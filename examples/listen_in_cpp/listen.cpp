// Listen to a cell from C++: Zenoh and msgpack alone, by docs/contract.md.
//
//   cmake -S examples/listen_in_cpp -B build && cmake --build build
//   build/listen [ROUTER] [CELL]        # beside a running `hmcs up`

#include <zenoh-pico.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

using nlohmann::json;

// An array travels as its type, its shape and its bytes, little-endian as this machine's are.
std::vector<double> numbers(const json &array) {
    const auto &data = array.at("data").get_binary();
    if (array.at("dtype") != "<f8") throw std::runtime_error("expected numbers of 8 bytes");
    std::vector<double> values(data.size() / sizeof(double));
    std::memcpy(values.data(), data.data(), values.size() * sizeof(double));
    return values;
}

void show(const json &message) {
    const auto schema = message.at("schema").get<std::string>();
    if (schema == "belief/1") {
        const auto sure = numbers(message.at("probabilities"));
        const auto likely = std::max_element(sure.begin(), sure.end()) - sure.begin();
        std::printf("step %ld: %s %.2f\n", message.at("step").get<long>(),
                    message.at("states").at(likely).get<std::string>().c_str(), sure[likely]);
    } else if (schema == "robot_state/3") {
        const auto at = numbers(message.at("tool_position"));
        std::printf("%s: %.3f %.3f %.3f m, %s\n",
                    message.at("source").at("instance").get<std::string>().c_str(), at[0], at[1],
                    at[2], message.at("stop").get<std::string>().c_str());
    }
    std::fflush(stdout);
}

void on_sample(z_loaned_sample_t *sample, void *) {
    z_owned_slice_t bytes;
    if (z_bytes_to_slice(z_sample_payload(sample), &bytes) != 0) return;
    const auto *begin = z_slice_data(z_loan(bytes));
    try {
        show(json::from_msgpack(begin, begin + z_slice_len(z_loan(bytes))));
    } catch (const std::exception &error) {
        std::cerr << "passed over: " << error.what() << '\n';
    }
    z_drop(z_move(bytes));
}

int main(int argc, char **argv) {
    const std::string router = argc > 1 ? argv[1] : "tcp/127.0.0.1:7447";
    const std::string cell = argc > 2 ? argv[2] : "demo";
    z_owned_config_t config;
    z_config_default(&config);
    zp_config_insert(z_loan_mut(config), Z_CONFIG_MODE_KEY, "client");
    zp_config_insert(z_loan_mut(config), Z_CONFIG_CONNECT_KEY, router.c_str());
    z_owned_session_t session;
    if (z_open(&session, z_move(config), nullptr) != 0) {
        std::cerr << "no router at " << router << '\n';
        return 1;
    }
    std::vector<z_owned_subscriber_t> subscribers(2);
    const std::string keys[] = {"model/*/belief/*", "robot/state"};
    for (std::size_t k = 0; k < subscribers.size(); ++k) {
        const std::string key = "hmcs/@v1/" + cell + "/" + keys[k];
        z_view_keyexpr_t expression;
        z_owned_closure_sample_t closure;
        z_closure(&closure, on_sample, nullptr, nullptr);
        if (z_view_keyexpr_from_str(&expression, key.c_str()) != 0 ||
            z_declare_subscriber(z_loan(session), &subscribers[k], z_loan(expression),
                                 z_move(closure), nullptr) != 0) {
            std::cerr << "cannot listen to " << key << '\n';
            return 1;
        }
    }
    for (;;) std::this_thread::sleep_for(std::chrono::seconds(1));
}
