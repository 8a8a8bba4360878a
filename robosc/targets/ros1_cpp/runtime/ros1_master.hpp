/* Asks the master again and again whether it knows this node. Without a master, nobody can connect to the robot's
   topics or end this node; a new master would let a second controller be started beside it. */

#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <string>
#include <thread>

#include <ros/ros.h>
#include <ros/xmlrpc_manager.h>
#include <xmlrpcpp/XmlRpcClient.h>
#include <xmlrpcpp/XmlRpcDispatch.h>

namespace robosc {

constexpr std::chrono::milliseconds MASTER_PERIOD{1000};
constexpr int MASTER_FAILURES = 3;

class MasterWatch {
public:
    MasterWatch()
        : name_(ros::this_node::getName())
        , uri_(ros::XMLRPCManager::instance()->getServerURI())
        , host_(ros::master::getHost())
        , port_(static_cast<int>(ros::master::getPort()))
        , thread_([this] { run(); })
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
    }

    bool is_lost() const { return is_lost_; }

private:
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
        return ended_.wait_for(lock, MASTER_PERIOD, [this] { return is_over_; });
    }

    /* A restarted master does not know the node. roscpp's own call would wait for a master that hangs. */
    bool is_known() const
    {
        XmlRpc::XmlRpcValue request;
        request[0] = name_;
        request[1] = name_;
        XmlRpc::XmlRpcClient client(host_.c_str(), port_, "/");
        if (!client.executeNonBlock("lookupNode", request)) {
            return false;
        }
        XmlRpc::XmlRpcDispatch dispatch;
        dispatch.addSource(&client, XmlRpc::XmlRpcDispatch::WritableEvent | XmlRpc::XmlRpcDispatch::Exception);
        /* The argument is in seconds, whatever its header says; it returns as soon as the client
           is done. */
        dispatch.work(std::chrono::duration<double>(MASTER_PERIOD).count());
        dispatch.removeSource(&client);
        XmlRpc::XmlRpcValue answer;
        if (!client.executeCheckDone(answer) || client.isFault()
            || answer.getType() != XmlRpc::XmlRpcValue::TypeArray || answer.size() != 3) {
            return false;
        }
        return answer[0].getType() == XmlRpc::XmlRpcValue::TypeInt && static_cast<int&>(answer[0]) == 1
            && answer[2].getType() == XmlRpc::XmlRpcValue::TypeString && static_cast<std::string&>(answer[2]) == uri_;
    }

    const std::string name_;
    const std::string uri_;
    const std::string host_;
    const int port_;
    std::mutex mutex_;
    std::condition_variable ended_;
    bool is_over_ = false;
    std::atomic<bool> is_lost_{false};
    /* The last: it uses all of the others. */
    std::thread thread_;
};

}  // namespace robosc
