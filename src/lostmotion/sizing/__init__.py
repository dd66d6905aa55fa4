"""Does a drive fit its task?"""
