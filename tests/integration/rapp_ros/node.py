"""A node that offers a service and a topic, and survives a restart of its master."""

import sys
import threading

import rospy
from rapp_msgs.srv import Say, SayResponse
from std_msgs.msg import String

from rapp_ros.rejoin import Rejoining

rospy.init_node("survivor", disable_rosout=True)
rospy.Service("answer", Say, lambda request: SayResponse(success=True, message=request.text))
publisher = rospy.Publisher("echo", String, queue_size=1)
rospy.Subscriber("shout", String, lambda message: publisher.publish(message.data.upper()))
rejoining = Rejoining()
print("READY {}", flush=True)
threading.Event().wait(float(sys.argv[1]))
rejoining.close()
