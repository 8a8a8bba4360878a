"""Takes what comes on /cmd_vel, until it is killed."""

import rospy
from geometry_msgs.msg import Twist

rospy.init_node("subscriber")
rospy.Subscriber("/cmd_vel", Twist, lambda message: None, queue_size=10)
rospy.spin()
