"""Programs written for NAOqi's old Python module, ported to Python 3, run with this one over the qi protocol.

Offers ALProxy, ALBroker and ALModule; everything that fails raises RuntimeError, with texts in NAOqi's form: "Module::method", a
line break, a tab, and what is wrong.
"""

from naoqi.broker import ALBroker
from naoqi.module import ALModule
from naoqi.proxy import ALProxy

__all__ = ["ALBroker", "ALModule", "ALProxy"]
