"""Interpretation of a long command from its sound (paper §III: the platform interprets it and names the RApp).

Method, in the order of the modules:

1. `sound`: any sound file becomes 16 kHz mono; a gentle spectral noise reduction.
2. `speech`, `beam`, `tokens`: speech to text with Moonshine "tiny" on ONNX Runtime; a beam search gives several
   texts with their probabilities, and the content words of the catalogue's sentences get a bonus ("contextual
   biasing"), each once: "a good joke", not "a good jolt", where the catalogue speaks of jokes.
3. `words`, `meaning`, `matching`: each text is compared with the RApps' sentences by meaning (sentence embedding
   all-MiniLM-L6-v2) and by rare words in common; nearness and margin of the best RApp, averaged over the texts, become a
   probability by a logistic regression. Below a threshold the answer is "not understood" (rapp None).

Why not pocketsphinx with its English model: on the development set it gets .39 / .76 / .85 / .93 of the words wrong at
20 / 10 / 5 / 0 dB, Moonshine .14 / .23 / .40 / .53. Tried and left, because they gave no more right answers at 1 % wrong:
stronger noise reduction, several versions of the sound pooled, and as further evidence the recogniser's own confidence and
what the bonus costs in likelihood. `config` names the measurements behind each setting. Figures on RApps, sentences and
voices that were used for no choice: `./rapp bench interpret`.
"""

from rapp_cloud.interpreter.config import InterpreterConfig
from rapp_cloud.interpreter.errors import InterpreterError
from rapp_cloud.interpreter.port import Commands, Interpretation, Interpreter

__all__ = ["Commands", "Interpretation", "Interpreter", "InterpreterConfig", "InterpreterError"]
