"""Aerial maps tried over ground maps in which they have no place: how often is one claimed?"""
