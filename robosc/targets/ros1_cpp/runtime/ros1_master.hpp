/* Asks the master again and again whether it knows this node. Without a master, nobody can connect to the robot's
   topics or end this node; a new master would let a second controller be started beside it. It also knows the nodes on
   this node's topics, and each of these the types that it uses. */

#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include <ros/network.h>
#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpcClient.h>
#include <xmlrpcpp/XmlRpcDispatch.h>

#include "values.hpp"

namespace robosc {

constexpr std::chrono::milliseconds MASTER_PERIOD{1000};
constexpr int MASTER_FAILURES = 3;
/* A node that did not tell its types is asked again at one look in so many. */
constexpr int LOOKS = 3;

/* What a master or a node answers, if it does in time. roscpp's own call would wait for a master that hangs. */
inline std::optional<XmlRpc::XmlRpcValue> answer_of(
    const std::string& host, int port, const char* method, const XmlRpc::XmlRpcValue& request)
{
    XmlRpc::XmlRpcClient client(host.c_str(), port, "/");
    if (!client.executeNonBlock(method, request)) {
        return std::nullopt;
    }
    XmlRpc::XmlRpcDispatch dispatch;
    dispatch.addSource(&client, XmlRpc::XmlRpcDispatch::WritableEvent | XmlRpc::XmlRpcDispatch::Exception);
    /* The argument is in seconds, whatever its header says; it returns as soon as the client
       is done. */
    dispatch.work(std::chrono::duration<double>(MASTER_PERIOD).count());
    dispatch.removeSource(&client);
    XmlRpc::XmlRpcValue answer;
    if (!client.executeCheckDone(answer) || client.isFault() || answer.getType() != XmlRpc::XmlRpcValue::TypeArray
        || answer.size() != 3 || answer[0].getType() != XmlRpc::XmlRpcValue::TypeInt
        || static_cast<int&>(answer[0]) != 1) {
        return std::nullopt;
    }
    return answer[2];
}

/* A topic of this node, and whether this node sends there. */
struct OwnTopic {
    std::string name;
    std::string type;
    bool sends;
};

/* Nodes on this node's topics that use another type, in words. ROS 1 refuses such a connection and tells the node that
   made it, if at all. */
class Peers {
public:
    explicit Peers(std::vector<OwnTopic> topics) : name_(ros::this_node::getName()), topics_(std::move(topics)) {}

    /* Ask whoever is new on a topic; a node that is not asked in time is not named. */
    template <class IsOver>
    Texts misfits(XmlRpc::XmlRpcValue state, const IsOver& is_over)
    {
        looks_++;
        std::set<std::string> found;
        std::set<std::string> used;
        for (const OwnTopic& topic : topics_) {
            for (const std::string& node : nodes_on(state[topic.sends ? 1 : 0], topic.name)) {
                if (node == name_ || is_over()) {
                    continue;
                }
                const std::string uri = uri_of(node);
                used.insert(uri);
                const std::string other = type_at(uri, topic);
                if (other != topic.type && other != "*") {
                    const char* const own = topic.sends ? "sends" : "takes";
                    const char* const others = topic.sends ? "takes" : "sends";
                    found.insert(topic.name + ": " + node + " " + others + " " + other + ", this node " + own + " "
                        + topic.type);
                }
            }
        }
        for (auto item = known_.begin(); item != known_.end();) {
            item = used.count(item->first) > 0 ? std::next(item) : known_.erase(item);
        }
        return Texts(found.begin(), found.end());
    }

private:
    /* The types of a node's topics by name and whether it sends there; none if it did not answer. */
    using Types = std::optional<std::map<std::pair<std::string, bool>, std::string>>;

    static std::vector<std::string> nodes_on(XmlRpc::XmlRpcValue& topics, const std::string& name)
    {
        std::vector<std::string> found;
        for (int k = 0; k < topics.size(); k++) {
            if (static_cast<std::string&>(topics[k][0]) == name) {
                for (int n = 0; n < topics[k][1].size(); n++) {
                    found.push_back(static_cast<std::string&>(topics[k][1][n]));
                }
            }
        }
        return found;
    }

    std::string uri_of(const std::string& node) const
    {
        XmlRpc::XmlRpcValue request;
        request[0] = name_;
        request[1] = node;
        auto answer = answer_of(ros::master::getHost(), static_cast<int>(ros::master::getPort()), "lookupNode", request);
        return answer ? static_cast<std::string&>(*answer) : std::string();
    }

    /* The type that a node uses on a topic; this node's own if that is not known. */
    std::string type_at(const std::string& uri, const OwnTopic& topic)
    {
        const std::pair<std::string, bool> key(topic.name, !topic.sends);
        const auto before = known_.find(uri);
        const bool is_news = before == known_.end() || (before->second && before->second->count(key) == 0);
        if (!uri.empty() && (is_news || (!before->second && looks_ % LOOKS == 0))) {
            known_[uri] = asked(uri);
        }
        const auto found = known_.find(uri);
        if (found == known_.end() || !found->second || found->second->count(key) == 0) {
            return topic.type;
        }
        return found->second->at(key);
    }

    Types asked(const std::string& uri) const
    {
        std::string host;
        std::uint32_t port = 0;
        Types types;
        XmlRpc::XmlRpcValue request;
        request[0] = name_;
        if (!ros::network::splitURI(uri, host, port)) {
            return types;
        }
        types.emplace();
        for (const bool sends : {true, false}) {
            auto answer
                = answer_of(host, static_cast<int>(port), sends ? "getPublications" : "getSubscriptions", request);
            if (!answer) {
                /* It was killed, and the master still knows it; or it is busy. */
                return std::nullopt;
            }
            for (int k = 0; k < answer->size(); k++) {
                (*types)[{static_cast<std::string&>((*answer)[k][0]), sends}]
                    = static_cast<std::string&>((*answer)[k][1]);
            }
        }
        return types;
    }

    const std::string name_;
    const std::vector<OwnTopic> topics_;
    std::map<std::string, Types> known_;
    int looks_ = 0;
};

class MasterWatch {
public:
    explicit MasterWatch(std::vector<OwnTopic> topics)
        : peers_(std::move(topics))
        , name_(ros::this_node::getName())
        , uri_(ros::XMLRPCManager::instance()->getServerURI())
        , host_(ros::master::getHost())
        , port_(static_cast<int>(ros::master::getPort()))
        , thread_([this] { run(); })
        , looking_([this] { look_at_peers(); })
    {
    }

    MasterWatch(const MasterWatch&) = delete;
    MasterWatch& operator=(const MasterWatch&) = delete;

    ~MasterWatch()
    {
        {
            const std::lock_guard<std::mutex> lock(mutex_);
            is_over_ = true;
        }
        ended_.notify_all();
        thread_.join();
        looking_.join();
    }

    bool is_lost() const { return is_lost_; }

    /* What keeps others on this node's topics from being connected, in words. */
    Texts misfits() const
    {
        const std::lock_guard<std::mutex> lock(mutex_);
        return misfits_;
    }

private:
    /* In a thread of its own: nodes that hang must not keep the master's loss from being seen. */
    void look_at_peers()
    {
        while (!waited()) {
            XmlRpc::XmlRpcValue request;
            request[0] = name_;
            try {
                const auto state = answer_of(host_, port_, "getSystemState", request);
                if (state) {
                    Texts found = peers_.misfits(*state, [this] { return is_over_.load(); });
                    const std::lock_guard<std::mutex> lock(mutex_);
                    misfits_ = std::move(found);
                }
            } catch (const XmlRpc::XmlRpcException&) {
                /* An answer that is no answer. */
                continue;
            }
        }
    }

    void run()
    {
        int failures = 0;
        while (!waited()) {
            failures = is_known() ? 0 : failures + 1;
            if (failures >= MASTER_FAILURES) {
                is_lost_ = true;
                return;
            }
        }
    }

    /* Wait for a period; whether it is over meanwhile. */
    bool waited()
    {
        std::unique_lock<std::mutex> lock(mutex_);
        return ended_.wait_for(lock, MASTER_PERIOD, [this] { return is_over_.load(); });
    }

    /* A restarted master does not know the node. */
    bool is_known() const
    {
        XmlRpc::XmlRpcValue request;
        request[0] = name_;
        request[1] = name_;
        auto answer = answer_of(host_, port_, "lookupNode", request);
        return answer && answer->getType() == XmlRpc::XmlRpcValue::TypeString
            && static_cast<std::string&>(*answer) == uri_;
    }

    Peers peers_;
    Texts misfits_;
    const std::string name_;
    const std::string uri_;
    const std::string host_;
    const int port_;
    mutable std::mutex mutex_;
    std::condition_variable ended_;
    std::atomic<bool> is_over_{false};
    std::atomic<bool> is_lost_{false};
    /* The last: they use all of the others. */
    std::thread thread_;
    std::thread looking_;
};

}  // namespace robosc
