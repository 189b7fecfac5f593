"""Functions of an arm beside people: keep away, follow a hand, hand over, give way and resume, each beside the function switched off."""
